// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "surface/store_window.hpp"

namespace terrace::terrain {

/// A rectangle of samples divided into windows that share their sides: the last column of one is
/// the first of the next.
class LatticePlan {
 public:
  /// lattice: at least 1 sample along each axis. cells: the target size of a window along each
  /// axis; windows are equal to within one cell and at most 1.5 times as large.
  LatticePlan(const LatticeWindow& lattice, std::int64_t cells);

  [[nodiscard]] std::size_t across() const { return columns_.size() - 1; }
  [[nodiscard]] std::size_t down() const { return rows_.size() - 1; }
  [[nodiscard]] std::size_t size() const { return across() * down(); }
  /// Window i, counted along rows from the first row on.
  [[nodiscard]] LatticeWindow window(std::size_t i) const;

  /// A sample and the windows that share it.
  struct Sample {
    std::uint64_t place = 0;  ///< its number in the whole rectangle, row by row
    unsigned windows = 1;
    std::size_t last = 0;  ///< the last of these windows
  };
  /// column, row: relative to window i.
  [[nodiscard]] Sample sample(std::size_t i, std::int64_t column, std::int64_t row) const;
  /// Appends the windows that contain a place of the lattice, sides included, ascending.
  void append_windows_at(const base::Point2& place, std::vector<std::uint32_t>& out) const;

 private:
  LatticeWindow lattice_;
  std::vector<std::int64_t> columns_, rows_;  ///< columns and rows of the sides
};

}  // namespace terrace::terrain
