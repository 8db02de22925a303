// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "terrace/tri/delaunay2.hpp"

/// The former contents of slots, recorded when a change first touches them. One bit per slot marks
/// it as touched, so the cost of recording does not depend on how often a slot is reused.

namespace terrace::tri {

/// Cells are the triangles or tetrahedra, by their corners.
template <class Point, std::size_t kCorners>
class Journal {
 public:
  using Corners = std::array<std::uint32_t, kCorners>;
  struct CellRecord {
    std::uint32_t slot;
    Corners former;  ///< kFreeCorner or a ghost: not a cell
  };
  struct VertexRecord {
    std::uint32_t slot;
    bool was_alive;
    Point former;
  };

  [[nodiscard]] bool on() const { return on_; }

  void start() {
    cells_ = {};
    vertices_ = {};
    on_ = true;
  }
  void stop() {
    start();
    on_ = false;
  }

  /// Must be called only while on(), before the slot changes.
  void touch_cell(std::uint32_t slot, const Corners& former) {
    if (cells_.first_touch(slot)) cells_.records.push_back({slot, former});
  }
  void touch_vertex(std::uint32_t slot, bool was_alive, const Point& former) {
    if (vertices_.first_touch(slot)) vertices_.records.push_back({slot, was_alive, former});
  }

  /// Calls visit(slot, former corners) for each cell that was touched.
  template <class Visit>
  void for_each_cell(const Visit& visit) const {
    for (const CellRecord& record : cells_.records) visit(record.slot, record.former);
  }
  /// Turns the records into net changes and empties the journal. The callbacks describe the current
  /// state: point(slot) returns the point of an existing vertex and corners(slot) the corners of a
  /// finite cell, both nullptr for others. is_finite(corners) classifies recorded cells. `changes`:
  /// an empty Changes of a triangulation. The last two arguments are its lists of cells.
  template <class CurrentPoint, class CurrentCorners, class IsFinite, class Changes, class CellId>
  void take(const CurrentPoint& point, const CurrentCorners& corners, const IsFinite& is_finite,
            Changes& changes, std::vector<CellId>& removed_cells,
            std::vector<CellId>& added_cells) {
    for (const VertexRecord& record : vertices_.records) {
      const Point* const current = point(record.slot);
      if (record.was_alive && current != nullptr && record.former == *current) {
        // The vertex is unchanged, so its cells may be unchanged too.
        vertices_.untouch(record.slot);
        continue;
      }
      if (record.was_alive) {
        changes.removed_vertices.push_back(VertexId{record.slot});
        changes.removed_points.push_back(record.former);
      }
      if (current != nullptr) changes.added_vertices.push_back(VertexId{record.slot});
    }
    const auto has_same_vertices = [&](const Corners& cell) {
      for (const std::uint32_t v : cell)
        if (vertices_.touched(v)) return false;
      return true;
    };
    for (const CellRecord& record : cells_.records) {
      const bool was_cell = is_finite(record.former);
      const Corners* const current = corners(record.slot);
      if (was_cell && current != nullptr && record.former == *current &&
          has_same_vertices(*current))
        continue;
      if (was_cell) {
        removed_cells.push_back(CellId{record.slot});
        auto& ids = changes.removed_corners.emplace_back();
        for (std::size_t i = 0; i < kCorners; ++i) ids[i] = VertexId{record.former[i]};
      }
      if (current != nullptr) added_cells.push_back(CellId{record.slot});
    }
    cells_.clear();
    vertices_.clear();
  }
  [[nodiscard]] std::size_t bytes() const { return cells_.bytes() + vertices_.bytes(); }

 private:
  template <class Record>
  struct Touched {
    std::vector<std::uint64_t> bits;
    std::vector<Record> records;

    bool first_touch(std::uint32_t slot) {
      const std::size_t word = slot / 64;
      if (word >= bits.size()) bits.resize(word + word / 8 + 16);
      const std::uint64_t bit = std::uint64_t{1} << (slot % 64);
      if ((bits[word] & bit) != 0) return false;
      bits[word] |= bit;
      return true;
    }
    [[nodiscard]] bool touched(std::uint32_t slot) const {
      return slot / 64 < bits.size() && (bits[slot / 64] >> (slot % 64) & 1) != 0;
    }
    void untouch(std::uint32_t slot) { bits[slot / 64] &= ~(std::uint64_t{1} << (slot % 64)); }
    void clear() {
      for (const Record& record : records) untouch(record.slot);
      records.clear();
    }
    [[nodiscard]] std::size_t bytes() const {
      return bits.capacity() * sizeof(std::uint64_t) + records.capacity() * sizeof(Record);
    }
  };

  bool on_ = false;
  Touched<CellRecord> cells_;
  Touched<VertexRecord> vertices_;
};

}  // namespace terrace::tri
