// SPDX-License-Identifier: Apache-2.0
#include "order/record_packer.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <cstring>
#include <utility>

#include "differing_bits.hpp"

namespace terrace::stream {
namespace {

/// Shorter runs of equal bytes are written with the bytes around them.
constexpr std::size_t kLeastGap = 3;
/// Records that are processed together, once per run; few enough to stay in the first-level cache.
constexpr std::size_t kRecordsAtOnce = 256;

/// Copies bytes of records, or of one record if `from_stride` is 0. Their number is a compile-time
/// constant.
template <std::size_t kBytes>
void copy_run(const std::byte* from, std::size_t from_stride, std::byte* to, std::size_t to_stride,
              std::size_t count) {
  for (; count > 0; --count, from += from_stride, to += to_stride) std::memcpy(to, from, kBytes);
}

template <std::size_t... kBytes>
constexpr auto copies_of_runs(std::index_sequence<kBytes...>) {
  return std::array{&copy_run<kBytes + 1>...};
}
constexpr std::size_t kMostInRun = 16;
/// The functions copy_run<n>, at index n - 1.
constexpr auto kCopyRun = copies_of_runs(std::make_index_sequence<kMostInRun>{});

}  // namespace

/// Finds the runs. Returns the number of bytes written for each record.
std::size_t RecordPacker::find_runs(std::span<const std::byte> differing) {
  runs_.clear();
  // Short gaps are written too, because fewer runs are faster.
  const auto same_at = [&](std::size_t at) {
    std::size_t end = at;
    while (end < record_bytes_ && differing[end] == std::byte{0}) ++end;
    return end - at >= kLeastGap ? end : at;
  };
  std::size_t written = 0;
  const auto add = [&](std::size_t from, std::size_t to, bool same) {
    for (std::size_t at = from; at < to; at += kMostInRun) {
      const std::size_t bytes = std::min(kMostInRun, to - at);
      runs_.push_back({.in_record = at, .written = written, .bytes = bytes, .same = same});
      if (!same) written += bytes;
    }
  };
  for (std::size_t at = 0; at < record_bytes_;) {
    const std::size_t same_to = same_at(at);
    add(at, same_to, true);
    at = same_to;
    while (at < record_bytes_ && same_at(at) == at) ++at;
    add(same_to, at, false);
  }
  return written;
}

std::span<const std::byte> RecordPacker::pack(std::span<const std::byte> records) {
  const std::size_t count = records.size() / record_bytes_;
  assert(count > 0);
  find_differing_bits(records, record_bytes_, differing_);
  const std::size_t written = find_runs(differing_);
  std::erase_if(runs_, [](const Run& run) { return run.same; });
  bytes_.resize(2 * record_bytes_ + count * written);
  std::memcpy(bytes_.data(), records.data(), record_bytes_);
  std::memcpy(bytes_.data() + record_bytes_, differing_.data(), record_bytes_);
  const std::byte* record = records.data();
  std::byte* to = bytes_.data() + 2 * record_bytes_;
  for (std::size_t left = count; left > 0;) {
    const std::size_t some = std::min(left, kRecordsAtOnce);
    for (const Run& run : runs_) {
      kCopyRun[run.bytes - 1](record + run.in_record, record_bytes_, to + run.written, written,
                              some);
    }
    record += some * record_bytes_;
    to += some * written;
    left -= some;
  }
  return bytes_;
}

void RecordPacker::unpack(std::span<const std::byte> packed, std::span<std::byte> records) {
  const std::size_t count = records.size() / record_bytes_;
  const std::size_t written = find_runs(packed.subspan(record_bytes_, record_bytes_));
  assert(packed.size() == 2 * record_bytes_ + count * written);
  const std::byte* const first = packed.data();
  const std::byte* from = packed.data() + 2 * record_bytes_;
  std::byte* record = records.data();
  for (std::size_t left = count; left > 0;) {
    const std::size_t some = std::min(left, kRecordsAtOnce);
    for (const Run& run : runs_) {
      kCopyRun[run.bytes - 1](run.same ? first + run.in_record : from + run.written,
                              run.same ? 0 : written, record + run.in_record, record_bytes_, some);
    }
    record += some * record_bytes_;
    from += some * written;
    left -= some;
  }
}

}  // namespace terrace::stream
