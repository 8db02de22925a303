// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include <terrace/stream/atomic_file.hpp>
#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/heights.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

enum class RasterValue : std::uint8_t { height, slope, aspect, hillshade };

struct RasterRequest {
  RasterValue value = RasterValue::height;
  SamplerOptions sampler{};
  std::optional<double> cell{};        ///< cell size in units of the output's CRS
  std::string align{};                 ///< a raster whose grid to use, in place of `cell`
  std::optional<Region> region{};      ///< in the store's CRS
  std::optional<Transformation> to{};  ///< to the output's CRS, if that is not the store's
  std::string output;                  ///< the GeoTIFF to write
  stream::Naming replace{};            ///< what happens to an existing file
};

struct RasterOutcome {
  std::uint64_t columns = 0, rows = 0, cells_with_data = 0;
};

/// Writes a Cloud Optimized GeoTIFF, PixelIsArea. The value of a cell is the surface's value at its
/// centre. Overviews, down to 512 x 512 cells, contain the mean of the cells with data that they
/// cover. Aspect has no mean, so its overviews contain the first of these cells.
///
/// At level 0, or with a focus of level 0, and in the store's CRS, the grid of a raster is its own
/// lattice, unless `cell` is set or the lattice is rotated. If `cell` is set, cell borders are at
/// multiples of it (as with gdalwarp -tap), so that all rasters of one cell size match. The grid
/// then covers the part of the region inside the store's area, ignoring conditions. Otherwise cells
/// start at the upper left corner of the region or of the selected area. A cell has about the mean
/// area per point of the finest level that is used, with its size rounded to two digits. Cells with
/// centres outside the region's polygons are nodata.
///
/// With `align`, the grid is the grid of another raster: its CRS, origin, cell size and extent.
/// Cells with centres outside the region are then nodata, also for a box.
///
/// Slope, aspect and hillshade are computed from the 3 x 3 heights around a cell of this grid with
/// Horn's formula (B. K. P. Horn, "Hill shading and the reflectance map",
/// doi:10.1109/PROC.1981.11918), using metres per cell on the ground and heights in metres. They
/// are nodata if one of the nine heights is. Slope is in degrees. Aspect is in degrees clockwise
/// from north, downhill, and nodata on level ground. Hillshade is 1 to 255 (0: nodata) with light
/// from 315 degrees at 45 degrees altitude.
///
/// Tiles are computed in quadtree order, so that a store of points is triangulated little more than
/// once. Memory: some tiles at a time, within the context's bound. Reports "cells"; notes any
/// assumption about units that slopes depend on, and if no cell has data. Throws: stream::Error if
/// the region does not meet the store, or if the raster to align with is rotated or its CRS is
/// unknown; UsageError for a grid of more than 2^31 columns or rows, and for `align` together with
/// `cell` or another `to`.
RasterOutcome write_raster(const stream::Store& store, const RasterRequest& request,
                           const Context& context = {});

}  // namespace terrace::terrain
