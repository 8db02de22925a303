// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <terrace/base/stop_check.hpp>
#include <terrace/stream/point.hpp>
#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/triangle_mesh.hpp"

namespace terrace::terrain {

/// A raster with squares of cells averaged into one: a mesh of a raster of any size in little
/// memory, for pictures.
class HeightGrid {
 public:
  /// Chooses the smallest squares that leave at most `max_cells` cells of columns x rows.
  HeightGrid(std::uint64_t columns, std::uint64_t rows, std::uint64_t max_cells,
             base::StopCheck check_stop = {});

  /// Adds a cell in stored coordinates (column, row, raw sample), in any order. Ignores cells
  /// outside.
  void add(const stream::Point3& cell);

  /// Returns the number of cells after the reduction.
  static std::uint64_t cells(std::uint64_t columns, std::uint64_t rows, std::uint64_t max_cells);

  [[nodiscard]] std::uint64_t reduction() const { return reduction_; }

  /// Returns a mesh with two triangles for a square of four cells with data, and one for three
  /// cells. Positions are stored coordinates.
  [[nodiscard]] TriangleMesh mesh() const;

 private:
  base::StopCheck check_stop_;
  std::uint64_t reduction_ = 1;
  std::uint64_t columns_ = 0, rows_ = 0;  ///< reduced
  std::uint64_t full_columns_ = 0, full_rows_ = 0;
  std::vector<double> sums_;
  std::vector<std::uint32_t> counts_;
};

/// Returns mesh() of all cells of a raster store. Throws: stream::Error, stream::Stopped, what
/// context.progress throws.
TriangleMesh reduced_raster(const stream::Store& store, std::uint64_t max_cells,
                            const Context& context);

}  // namespace terrace::terrain
