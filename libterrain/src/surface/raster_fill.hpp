// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include <terrace/stream/store.hpp>

#include "surface/filled_grid.hpp"
#include "surface/store_window.hpp"

namespace terrace::terrain {

/// Heights for the cells of a raster that have no data, from those around. It depends on the store
/// alone and is the same from whichever window it is asked.
class RasterFill {
 public:
  /// Reads one level of the store. Memory: at most 8 MiB for the finest grid and a third more.
  /// Throws: stream::Error on a damaged store, or if it has no point at all.
  explicit RasterFill(const stream::Store& store);

  /// The height at a place of the lattice, in the vertical unit of the store. Outside the raster
  /// that of its border.
  [[nodiscard]] double height(double column, double row) const;

  /// A number of what height() depends on for places in the window, borders included: of two
  /// rasters of equal size with the same number it gives the same there.
  [[nodiscard]] std::uint64_t digest(const LatticeWindow& window) const;

 private:
  std::optional<FilledGrid> grid_;
  double reduction_ = 1.0;  ///< samples per cell of the grid
};

}  // namespace terrace::terrain
