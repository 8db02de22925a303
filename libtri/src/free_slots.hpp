// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

/// The free slots of an array, one bit each. Allocates nothing before the first slot is freed.

namespace terrace::tri {

/// Takes slots in blocks of 64, the most recently freed block first, and the lowest slot of a block
/// first. Slots that are freed together and reused together therefore stay together in memory, in
/// whatever order they are freed and taken. (If slots were chained in the order of their freeing,
/// those of a cluster would come back shuffled; once the cluster has left the caches this takes
/// twice the time.)
class FreeSlots {
 public:
  [[nodiscard]] bool empty() const { return blocks_.empty(); }
  /// The slot that take() would return. Requires !empty().
  [[nodiscard]] std::uint32_t next() const {
    const std::uint32_t block = blocks_.back();
    return block * 64 + static_cast<std::uint32_t>(std::countr_zero(bits_[block]));
  }
  std::uint32_t take() {
    const std::uint32_t slot = next();
    std::uint64_t& bits = bits_[slot / 64];
    bits &= bits - 1;
    if (bits == 0) blocks_.pop_back();
    return slot;
  }
  void put(std::uint32_t slot) {
    const std::uint32_t block = slot / 64;
    if (block >= bits_.size()) bits_.resize(block + block / 8 + 1);
    if (bits_[block] == 0) blocks_.push_back(block);
    bits_[block] |= std::uint64_t{1} << (slot % 64);
  }
  void clear() {
    bits_.clear();
    blocks_.clear();
  }

  /// O(slots / 64).
  [[nodiscard]] std::size_t count() const {
    std::size_t result = 0;
    for (const std::uint32_t block : blocks_)
      result += static_cast<std::size_t>(std::popcount(bits_[block]));
    return result;
  }
  [[nodiscard]] bool contains(std::uint32_t slot) const {
    return slot / 64 < bits_.size() && (bits_[slot / 64] >> (slot % 64) & 1) != 0;
  }
  [[nodiscard]] std::size_t bytes() const {
    return bits_.capacity() * sizeof(std::uint64_t) + blocks_.capacity() * sizeof(std::uint32_t);
  }

 private:
  std::vector<std::uint64_t> bits_;
  std::vector<std::uint32_t> blocks_;  ///< blocks with a set bit, as a stack
};

}  // namespace terrace::tri
