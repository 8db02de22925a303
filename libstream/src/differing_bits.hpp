// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace terrace::stream {

/// Sets `differing`, one byte per byte of a record, to the bits in which any record differs from
/// the first.
inline void find_differing_bits(std::span<const std::byte> records, std::size_t record_bytes,
                                std::vector<std::byte>& differing) {
  differing.assign(record_bytes, std::byte{0});
  const std::size_t count = record_bytes == 0 ? 0 : records.size() / record_bytes;
  if (count == 0) return;
  const auto find = [&](std::size_t offset, auto word) {
    using Word = decltype(word);
    const std::byte* at = records.data() + offset;
    Word first;
    std::memcpy(&first, at, sizeof first);
    Word bits = 0;
    for (std::size_t i = 0; i < count; ++i, at += record_bytes) {
      std::memcpy(&word, at, sizeof word);
      bits = static_cast<Word>(bits | (word ^ first));
    }
    std::memcpy(differing.data() + offset, &bits, sizeof bits);
  };
  std::size_t offset = 0;
  for (; offset + 8 <= record_bytes; offset += 8) find(offset, std::uint64_t{});
  if (offset < record_bytes && record_bytes >= 8) return find(record_bytes - 8, std::uint64_t{});
  for (; offset < record_bytes; ++offset) find(offset, std::uint8_t{});
}

}  // namespace terrace::stream
