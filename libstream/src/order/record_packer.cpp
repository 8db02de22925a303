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
constexpr std::size_t kMinGap = 3;
/// Records that are processed together, once per run; few enough to stay in the first-level cache.
constexpr std::size_t kBatchRecords = 256;

/// Copies bytes of records, or of one record if `source_stride` is 0. Their number is a
/// compile-time constant.
template <std::size_t kBytes>
void copy_run(const std::byte* source, std::size_t source_stride, std::byte* target,
              std::size_t target_stride, std::size_t count) {
  for (; count > 0; --count, source += source_stride, target += target_stride)
    std::memcpy(target, source, kBytes);
}

template <std::size_t... kBytes>
constexpr auto copies_of_runs(std::index_sequence<kBytes...>) {
  return std::array{&copy_run<kBytes + 1>...};
}
constexpr std::size_t kMaxInRun = 16;
/// The functions copy_run<n>, at index n - 1.
constexpr auto kCopyRun = copies_of_runs(std::make_index_sequence<kMaxInRun>{});

}  // namespace

/// Finds the runs. Returns the number of bytes written for each record.
std::size_t RecordPacker::find_runs(std::span<const std::byte> differing) {
  runs_.clear();
  // Short gaps are written too, because fewer runs are faster.
  const auto same_at = [&](std::size_t at) {
    std::size_t end = at;
    while (end < record_bytes_ && differing[end] == std::byte{0}) ++end;
    return end - at >= kMinGap ? end : at;
  };
  std::size_t packed_bytes = 0;
  const auto add = [&](std::size_t source, std::size_t target, bool same) {
    for (std::size_t at = source; at < target; at += kMaxInRun) {
      const std::size_t bytes = std::min(kMaxInRun, target - at);
      runs_.push_back(
          {.record_offset = at, .packed_offset = packed_bytes, .bytes = bytes, .same = same});
      if (!same) packed_bytes += bytes;
    }
  };
  for (std::size_t at = 0; at < record_bytes_;) {
    const std::size_t same_end = same_at(at);
    add(at, same_end, true);
    at = same_end;
    while (at < record_bytes_ && same_at(at) == at) ++at;
    add(same_end, at, false);
  }
  return packed_bytes;
}

std::span<const std::byte> RecordPacker::pack(std::span<const std::byte> records) {
  const std::size_t count = records.size() / record_bytes_;
  assert(count > 0);
  find_differing_bits(records, record_bytes_, differing_);
  const std::size_t packed_bytes = find_runs(differing_);
  std::erase_if(runs_, [](const Run& run) { return run.same; });
  bytes_.resize(2 * record_bytes_ + count * packed_bytes);
  std::memcpy(bytes_.data(), records.data(), record_bytes_);
  std::memcpy(bytes_.data() + record_bytes_, differing_.data(), record_bytes_);
  const std::byte* record = records.data();
  std::byte* target = bytes_.data() + 2 * record_bytes_;
  for (std::size_t remaining = count; remaining > 0;) {
    const std::size_t batch = std::min(remaining, kBatchRecords);
    for (const Run& run : runs_) {
      kCopyRun[run.bytes - 1](record + run.record_offset, record_bytes_, target + run.packed_offset,
                              packed_bytes, batch);
    }
    record += batch * record_bytes_;
    target += batch * packed_bytes;
    remaining -= batch;
  }
  return bytes_;
}

void RecordPacker::unpack(std::span<const std::byte> packed, std::span<std::byte> records) {
  const std::size_t count = records.size() / record_bytes_;
  const std::size_t packed_bytes = find_runs(packed.subspan(record_bytes_, record_bytes_));
  assert(packed.size() == 2 * record_bytes_ + count * packed_bytes);
  const std::byte* const first = packed.data();
  const std::byte* source = packed.data() + 2 * record_bytes_;
  std::byte* record = records.data();
  for (std::size_t remaining = count; remaining > 0;) {
    const std::size_t batch = std::min(remaining, kBatchRecords);
    for (const Run& run : runs_) {
      kCopyRun[run.bytes - 1](run.same ? first + run.record_offset : source + run.packed_offset,
                              run.same ? 0 : packed_bytes, record + run.record_offset,
                              record_bytes_, batch);
    }
    record += batch * record_bytes_;
    source += batch * packed_bytes;
    remaining -= batch;
  }
}

}  // namespace terrace::stream
