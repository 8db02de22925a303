// SPDX-License-Identifier: Apache-2.0
#include "order/record_packer.hpp"

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <cstring>

#include "differing_bits.hpp"

namespace terrace::stream {
namespace {

/// Runs are copied as words of this many bytes. What a word brings along is written over by the
/// next one; only so many of the last records could bring along bytes beyond their ends.
constexpr std::size_t kWordBytes = sizeof(std::uint64_t);
/// Fewer bytes that are the same are written with those around them.
constexpr std::size_t kLeastGap = 3;

void copy_word(const std::byte* from, std::byte* to) {
  std::uint64_t word;
  std::memcpy(&word, from, sizeof word);
  std::memcpy(to, &word, sizeof word);
}

}  // namespace

/// Returns how many bytes are written of each record.
std::size_t RecordPacker::find_runs(std::span<const std::byte> differing) {
  runs_.clear();
  // Short gaps are written: fewer runs are faster.
  const auto same_at = [&](std::size_t at) {
    std::size_t end = at;
    while (end < record_bytes_ && differing[end] == std::byte{0}) ++end;
    return end - at >= kLeastGap ? end : at;
  };
  std::size_t written = 0;
  const auto add = [&](std::size_t from, std::size_t to, bool same) {
    for (std::size_t at = from; at < to; at += kWordBytes) {
      const std::size_t bytes = std::min(kWordBytes, to - at);
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
  for (std::size_t left = count; left > 0; --left, record += record_bytes_, to += written) {
    if (left > kWordBytes) {
      for (const Run& run : runs_) copy_word(record + run.in_record, to + run.written);
    } else {
      for (const Run& run : runs_) {
        std::memcpy(to + run.written, record + run.in_record, run.bytes);
      }
    }
  }
  return bytes_;
}

void RecordPacker::unpack(std::span<const std::byte> packed, std::span<std::byte> records) {
  const std::size_t count = records.size() / record_bytes_;
  const std::size_t written = find_runs(packed.subspan(record_bytes_, record_bytes_));
  assert(packed.size() == 2 * record_bytes_ + count * written);
  // All records begin as the first one, of which bytes in between are written over.
  const std::byte* const first = packed.data();
  const std::byte* from = packed.data() + 2 * record_bytes_;
  std::byte* record = records.data();
  for (std::size_t left = count; left > 0; --left, record += record_bytes_, from += written) {
    if (left > kWordBytes && written >= 1) {
      for (const Run& run : runs_) {
        copy_word(run.same ? first + run.in_record : from + run.written, record + run.in_record);
      }
    } else {
      for (const Run& run : runs_) {
        std::memcpy(record + run.in_record, run.same ? first + run.in_record : from + run.written,
                    run.bytes);
      }
    }
  }
}

}  // namespace terrace::stream
