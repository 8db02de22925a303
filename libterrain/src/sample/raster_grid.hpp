// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/raster.hpp"

namespace terrace::terrain {

/// The cells of a raster to write: the centre of (0, 0), and steps per column and row.
struct RasterGrid {
  double x = 0, y = 0, step_x = 1, step_y = -1;
  std::uint32_t columns = 0, rows = 0;
};

/// Returns the grid that write_raster() describes. Throws: as write_raster().
RasterGrid raster_grid(const stream::Store& store, const RasterRequest& request);

/// Returns the grid of the raster to align with. Sets request.to if its CRS is not the store's.
RasterGrid aligned_grid(const stream::Store& store, RasterRequest& request, const Context& context);

}  // namespace terrace::terrain
