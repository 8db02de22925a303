// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mesh.hpp"

namespace terrace::tri::spatial {

/// A part of the mesh in which one thread inserts while others do in theirs: the tetrahedra whose
/// corners (but for the ghost) all have numbers in one range, which may go round the end. Such a
/// tetrahedron only this thread reads and writes; one with corners in several ranges nobody writes,
/// and all may read it. So what a part does depends on nothing that other parts do meanwhile.
///
/// New tetrahedra go to blocks of slots that alternate between the parts.
class Part {
 public:
  static constexpr bool kWhole = false;
  static constexpr std::uint32_t kBlock = 128;  ///< marks of two cache lines

  /// Vertices first, first + 1, ..., `size` of `all` in a circle that begins at `begin`.
  struct Range {
    std::uint32_t begin, all, first, size;

    [[nodiscard]] bool has(std::uint32_t v) const {
      std::uint32_t place = v - first;
      if (place >= all) place += all;
      return place < size;
    }
  };

  /// Slots from `base` on: `blocks` blocks for each of `parts` parts, of which this is number
  /// `number`; free_list: slots that this part may use first.
  Part(const Range& range, std::uint32_t base, std::uint32_t parts, std::uint32_t number,
       std::uint32_t blocks, std::uint32_t free_list)
      : range_(range),
        base_(base),
        parts_(parts),
        number_(number),
        room_(blocks * kBlock),
        free_(free_list) {}

  [[nodiscard]] const Range& range() const { return range_; }
  [[nodiscard]] bool owns(std::uint32_t corner) const {
    return range_.has(corner) || corner == kGhost;
  }
  [[nodiscard]] bool owns(const Tetrahedron& t) const {
    for (const std::uint32_t v : t.corner)
      if (!owns(v)) return false;
    return true;
  }
  /// Whether the neighbour beyond facet i may be read: where a corner of that facet is in the range
  /// it belongs to nobody else.
  [[nodiscard]] bool may_read_beyond(const Tetrahedron& t, std::uint32_t i) const {
    for (std::uint32_t k = 0; k < 4; ++k)
      if (k != i && range_.has(t.corner[k])) return true;
    return false;
  }

  /// Whether so many more slots are there for sure.
  [[nodiscard]] bool has_room(std::size_t count) const { return used_ + count <= room_; }
  template <class Mesh>
  std::uint32_t new_tetrahedron(Mesh& mesh) {
    if (free_ == kNone) return slot_at(used_++);
    const std::uint32_t t = free_;
    free_ = mesh.tetrahedron[t].corner[1];
    return t;
  }
  template <class Mesh>
  void free_tetrahedron(Mesh& mesh, std::uint32_t t) {
    mesh.tetrahedron[t].corner[0] = kFreeCorner;
    mesh.tetrahedron[t].corner[1] = free_;
    free_ = t;
  }
  template <class Mesh>
  void count(Mesh&, std::int64_t not_ghosts, std::int64_t all) {
    finite_ += not_ghosts + all;
  }

  [[nodiscard]] std::uint32_t used() const { return used_; }
  [[nodiscard]] std::uint32_t slot_at(std::uint32_t i) const {
    return base_ + (i / kBlock * parts_ + number_) * kBlock + i % kBlock;
  }
  [[nodiscard]] std::uint32_t free_list() const { return free_; }
  [[nodiscard]] std::int64_t finite() const { return finite_; }

 private:
  Range range_;
  std::uint32_t base_;
  std::uint32_t parts_;
  std::uint32_t number_;
  std::uint32_t room_;
  std::uint32_t used_ = 0;
  std::uint32_t free_;
  std::int64_t finite_ = 0;
};

}  // namespace terrace::tri::spatial
