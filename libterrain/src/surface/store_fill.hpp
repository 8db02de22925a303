// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <terrace/stream/store.hpp>

#include "surface/filled_grid.hpp"
#include "surface/store_window.hpp"

namespace terrace::terrain {

/// Heights everywhere, from those around: for cells of a raster that have no data, and for places
/// that no surface through irregular points reaches. It depends on the store alone and is the same
/// from whichever window it is asked.
class StoreFill {
 public:
  /// Reads one level of the store. Memory: at most 20 MiB, 4 MiB of them to stay.
  /// Throws: stream::Error on a damaged store, or if nothing in it has a height.
  explicit StoreFill(const stream::Store& store);

  /// The height at stored x, y in the vertical unit of the store. Far outside that of the border.
  [[nodiscard]] double height(double x, double y) const;

  /// A number of what height() depends on for places in the box, borders included: of two rasters
  /// of equal size with the same number it gives the same there.
  [[nodiscard]] std::uint64_t digest(const StoredBox& box) const;

 private:
  [[nodiscard]] std::array<double, 2> in_cells(const std::array<double, 2>& place) const {
    return {(place[0] - from_[0]) / cell_[0], (place[1] - from_[1]) / cell_[1]};
  }

  std::array<double, 2> from_{}, cell_{1.0, 1.0};  ///< of the grid, in stored x, y
  std::optional<FilledGrid> grid_;
};

}  // namespace terrace::terrain
