// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

/// What slots held when a change first touched them. One bit per slot tells whether it was touched
/// already, so the cost of recording does not depend on how often a slot is used again.

namespace terrace::tri {

/// Cells are the triangles or tetrahedra, by their corners.
template <class Point, std::size_t kCorners>
class Journal {
 public:
  using Corners = std::array<std::uint32_t, kCorners>;
  struct CellRecord {
    std::uint32_t slot;
    Corners before;  ///< kFreeCorner or a ghost: no cell
  };
  struct VertexRecord {
    std::uint32_t slot;
    bool was_alive;
    Point before;
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

  /// Call only while on(), before the slot changes.
  void touch_cell(std::uint32_t slot, const Corners& before) {
    if (cells_.first_touch(slot)) cells_.records.push_back({slot, before});
  }
  void touch_vertex(std::uint32_t slot, bool was_alive, const Point& before) {
    if (vertices_.first_touch(slot)) vertices_.records.push_back({slot, was_alive, before});
  }

  [[nodiscard]] const std::vector<CellRecord>& cells() const { return cells_.records; }
  [[nodiscard]] const std::vector<VertexRecord>& vertices() const { return vertices_.records; }
  [[nodiscard]] bool vertex_touched(std::uint32_t slot) const { return vertices_.touched(slot); }
  void forget_vertex(std::uint32_t slot) { vertices_.untouch(slot); }
  void clear() {
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
