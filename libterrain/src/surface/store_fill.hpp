// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <terrace/stream/store.hpp>

#include "surface/store_window.hpp"

namespace terrace::terrain {

/// A grid of means with gaps filled from surrounding cells: a smooth surface made by averaging
/// upward and filling downward over halved grids (S. J. Gortler et al., The Lumigraph, 1996,
/// doi:10.1145/237170.237200, "pull-push").
class FilledGrid {
 public:
  /// sum, weight: by rows, columns * rows of each; a cell without weight is a gap. At least one
  /// cell must have weight.
  FilledGrid(std::size_t columns, std::size_t rows, std::vector<double> sum,
             std::vector<double> weight);

  /// Interpolates bilinearly between the centres of cells; x, y in cells, with the first cell's
  /// centre at 0.5. Outside the grid returns the height at its border.
  [[nodiscard]] double height(double x, double y) const;

  /// A hash of everything that height() depends on from `first` to `last`, inclusive: grids of
  /// equal size with equal hashes have equal heights there.
  [[nodiscard]] std::uint64_t digest(const std::array<double, 2>& first,
                                     const std::array<double, 2>& last) const;

 private:
  std::size_t columns_ = 0, rows_ = 0;
  std::vector<float> heights_;
};

/// Heights everywhere, interpolated from surrounding heights: for cells of a raster without data,
/// and for places beyond the hull of irregular points. Depends only on the store.
class StoreFill {
 public:
  /// Reads one level of the store. Memory: at most 20 MiB, then 4 MiB. Throws: stream::Error on a
  /// damaged store, or if nothing in it has a height.
  explicit StoreFill(const stream::Store& store);

  /// Returns the height at stored x, y in the vertical unit of the store. Far outside, it is the
  /// height at the border.
  [[nodiscard]] double height(double x, double y) const;

  /// A hash of everything that height() depends on in the closed box: rasters of equal size with
  /// equal hashes have equal heights there.
  [[nodiscard]] std::uint64_t digest(const StoredBox& box) const;

 private:
  [[nodiscard]] std::array<double, 2> in_cells(const std::array<double, 2>& place) const {
    return {(place[0] - from_[0]) / cell_[0], (place[1] - from_[1]) / cell_[1]};
  }

  std::array<double, 2> from_{},
      cell_{1.0, 1.0};  ///< origin and cell size of the grid, in stored x, y
  std::optional<FilledGrid> grid_;
};

}  // namespace terrace::terrain
