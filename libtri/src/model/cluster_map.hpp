// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "terrace/tri/multiresolution.hpp"

namespace terrace::tri {

/// The position of a cluster in the tree of expanded clusters: below the expanded cluster in slot
/// `parent`, headed by its member `index`, or by its own head if `index` is its number of members.
struct ChildRef {
  std::uint32_t parent = 0;
  std::uint32_t index = 0;
  friend bool operator==(const ChildRef&, const ChildRef&) = default;
};

/// A hash table from cluster id to ChildRef: open addressing, linear probing, deletion by shifting
/// back. There are no tombstones, so lookups stay short however often clusters come and go. 16
/// bytes per entry. Once it has grown, between 3/8 and 3/4 of the entries are occupied.
class ClusterMap {
 public:
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t memory() const { return entries_.capacity() * sizeof(Entry); }

  /// Makes room so that the next `count` insertions cannot fail.
  void reserve(std::size_t count) {
    std::size_t capacity = entries_.empty() ? 16 : entries_.size();
    while (count > capacity / 4 * 3) capacity *= 2;
    if (capacity > entries_.size()) grow(capacity);
  }

  [[nodiscard]] const ChildRef* find(ClusterId id) const {
    if (entries_.empty()) return nullptr;
    for (std::size_t i = first_slot(id);; i = next(i)) {
      if (entries_[i].id == id) return &entries_[i].child;
      if (entries_[i].id == kFree) return nullptr;
    }
  }

  /// Returns false, and changes nothing, if the id already exists. Requires reserved space.
  bool insert(ClusterId id, ChildRef child) {
    assert(size_ < entries_.size() / 4 * 3);
    std::size_t i = first_slot(id);
    for (; entries_[i].id != kFree; i = next(i)) {
      if (entries_[i].id == id) return false;
    }
    entries_[i] = {id, child};
    ++size_;
    return true;
  }

  void erase(ClusterId id) {
    std::size_t hole = first_slot(id);
    while (entries_[hole].id != id) {
      assert(entries_[hole].id != kFree);
      hole = next(hole);
    }
    // An entry whose probe sequence crosses the hole moves into it and leaves the next hole.
    for (std::size_t i = next(hole); entries_[i].id != kFree; i = next(i)) {
      const std::size_t distance = (i - first_slot(entries_[i].id)) & (entries_.size() - 1);
      const std::size_t from_hole = (i - hole) & (entries_.size() - 1);
      if (distance < from_hole) continue;
      entries_[hole] = entries_[i];
      hole = i;
    }
    entries_[hole].id = kFree;
    --size_;
  }

 private:
  // on level 255, with the only ordinal that is never used
  static constexpr ClusterId kFree{~std::uint64_t{0}};
  struct Entry {
    ClusterId id = kFree;
    ChildRef child;
  };

  // Fibonacci hashing spreads consecutive ordinals far apart.
  [[nodiscard]] std::size_t first_slot(ClusterId id) const {
    return static_cast<std::size_t>((static_cast<std::uint64_t>(id) * 0x9E3779B97F4A7C15u) >>
                                    shift_);
  }
  [[nodiscard]] std::size_t next(std::size_t i) const { return (i + 1) & (entries_.size() - 1); }

  void grow(std::size_t count) {
    std::vector<Entry> old(count);
    old.swap(entries_);
    shift_ = 64;
    for (std::size_t n = count; n > 1; n /= 2) --shift_;
    size_ = 0;
    for (const Entry& entry : old) {
      if (entry.id != kFree) insert(entry.id, entry.child);
    }
  }

  std::vector<Entry> entries_;
  std::size_t size_ = 0;
  unsigned shift_ = 64;
};

}  // namespace terrace::tri
