// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstdint>
#include <vector>

namespace terrace::tri::spatial {

/// A table of facets by their three corners (small numbers, in any order), with open addressing.
/// Every facet is looked up at most twice, so entries are never removed.
struct FacetEntry {
  std::uint64_t key;
  std::uint32_t facet;
};

class FacetTable {
 public:
  static constexpr std::uint32_t kMaxCorner = (std::uint32_t{1} << 21) - 1;

  explicit FacetTable(std::vector<FacetEntry>& memory) : memory_(memory) {}

  void clear(std::size_t expected) {
    resize(std::bit_ceil(std::max<std::size_t>(64, 4 * expected)));
    count_ = 0;
  }

  /// Returns the facet with these corners. If there is none yet, adds `facet`.
  std::uint32_t find_or_add(const std::array<std::uint32_t, 3>& corner, std::uint32_t facet) {
    if (2 * count_ >= size_) [[unlikely]]
      grow();
    const std::uint64_t key = key_of(corner);
    std::size_t i = first_slot(key);
    for (; memory_[i].key != 0; i = (i + 1) & (size_ - 1))
      if (memory_[i].key == key) return memory_[i].facet;
    memory_[i] = {key, facet};
    ++count_;
    return facet;
  }

 private:
  /// Never 0, because at most one of the corners is 0.
  static std::uint64_t key_of(const std::array<std::uint32_t, 3>& corner) {
    const auto [low, high] = std::minmax(corner[0], corner[1]);
    const std::uint64_t least = std::min(low, corner[2]);
    const std::uint64_t greatest = std::max(high, corner[2]);
    const std::uint64_t middle =
        std::uint64_t{corner[0]} + corner[1] + corner[2] - least - greatest;
    assert(greatest <= kMaxCorner);
    return least << 42 | middle << 21 | greatest;
  }
  [[nodiscard]] std::size_t first_slot(std::uint64_t key) const {
    return static_cast<std::size_t>(key * 0x9E3779B97F4A7C15u >> shift_);
  }
  void resize(std::size_t size) {
    size_ = size;
    shift_ = 64 - static_cast<unsigned>(std::countr_zero(size));
    memory_.assign(size, {0, 0});
  }
  void grow() {
    std::vector<FacetEntry> old_entries(memory_.begin(),
                                        memory_.begin() + static_cast<std::ptrdiff_t>(size_));
    resize(2 * size_);
    for (const FacetEntry& entry : old_entries) {
      if (entry.key == 0) continue;
      std::size_t i = first_slot(entry.key);
      while (memory_[i].key != 0) i = (i + 1) & (size_ - 1);
      memory_[i] = entry;
    }
  }

  std::vector<FacetEntry>& memory_;
  std::size_t size_ = 0;
  std::size_t count_ = 0;
  unsigned shift_ = 0;
};

}  // namespace terrace::tri::spatial
