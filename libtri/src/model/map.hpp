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
/// bytes per place; once it has grown, between 3/8 and 3/4 of the places are occupied.
class ClusterMap {
 public:
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t memory() const { return places_.capacity() * sizeof(Place); }

  /// Makes room so that the next `count` insertions cannot fail.
  void reserve(std::size_t count) {
    std::size_t wanted = places_.empty() ? 16 : places_.size();
    while (count > wanted / 4 * 3) wanted *= 2;
    if (wanted > places_.size()) grow(wanted);
  }

  [[nodiscard]] const ChildRef* find(ClusterId id) const {
    if (places_.empty()) return nullptr;
    for (std::size_t i = home(id);; i = next(i)) {
      if (places_[i].id == id) return &places_[i].where;
      if (places_[i].id == kFree) return nullptr;
    }
  }

  /// Returns false, and changes nothing, if the id already exists. Requires a reserved place.
  bool insert(ClusterId id, ChildRef where) {
    assert(size_ < places_.size() / 4 * 3);
    std::size_t i = home(id);
    for (; places_[i].id != kFree; i = next(i)) {
      if (places_[i].id == id) return false;
    }
    places_[i] = {id, where};
    ++size_;
    return true;
  }

  void erase(ClusterId id) {
    std::size_t hole = home(id);
    while (places_[hole].id != id) {
      assert(places_[hole].id != kFree);
      hole = next(hole);
    }
    // An entry whose probe sequence crosses the hole moves into it and leaves the next hole.
    for (std::size_t i = next(hole); places_[i].id != kFree; i = next(i)) {
      const std::size_t from_home = (i - home(places_[i].id)) & (places_.size() - 1);
      const std::size_t from_hole = (i - hole) & (places_.size() - 1);
      if (from_home < from_hole) continue;
      places_[hole] = places_[i];
      hole = i;
    }
    places_[hole].id = kFree;
    --size_;
  }

 private:
  // on level 255, with the only ordinal that is never used
  static constexpr ClusterId kFree{~std::uint64_t{0}};
  struct Place {
    ClusterId id = kFree;
    ChildRef where;
  };

  // Fibonacci hashing spreads consecutive ordinals far apart.
  [[nodiscard]] std::size_t home(ClusterId id) const {
    return static_cast<std::size_t>((static_cast<std::uint64_t>(id) * 0x9E3779B97F4A7C15u) >>
                                    shift_);
  }
  [[nodiscard]] std::size_t next(std::size_t i) const { return (i + 1) & (places_.size() - 1); }

  void grow(std::size_t count) {
    std::vector<Place> old(count);
    old.swap(places_);
    shift_ = 64;
    for (std::size_t n = count; n > 1; n /= 2) --shift_;
    size_ = 0;
    for (const Place& place : old) {
      if (place.id != kFree) insert(place.id, place.where);
    }
  }

  std::vector<Place> places_;
  std::size_t size_ = 0;
  unsigned shift_ = 64;
};

}  // namespace terrace::tri
