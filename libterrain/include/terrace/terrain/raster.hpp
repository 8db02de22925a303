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
  std::optional<double> cell{};        ///< width and height in units of the output's CRS
  std::string align{};                 ///< in place of `cell`: a raster, whose grid is taken
  std::optional<Region> region{};      ///< in the store's CRS
  std::optional<Transformation> to{};  ///< to the output's CRS if it is not the store's
  std::string output;                  ///< a GeoTIFF
  stream::Naming replace{};            ///< of an existing file
};

struct RasterOutcome {
  std::uint64_t columns = 0, rows = 0, cells_with_data = 0;
};

/// Writes a Cloud Optimized GeoTIFF, PixelIsArea: the value of a cell is that of the surface in its
/// centre. Overviews, down to 512 x 512 cells, have the mean of the cells with data below theirs;
/// of aspect, which has no mean, the first of them.
///
/// The grid: without a cell size, at level 0 and in the store's CRS it is a raster's own lattice
/// (rotated ones have none). Cells of a given size have their borders at its multiples (as gdalwarp
/// -tap has them), so that all rasters of one cell size fit each other, whatever was selected;
/// together they hold the part of the region that is in the area of the store, conditions aside.
/// Else cells go from the upper left corner of the region, or of the selected area, on; they have
/// about the area that a point of the level has on average, the size rounded to two digits. Cells
/// whose centres are outside the region's polygons are nodata.
///
/// With `align` the grid is that of another raster, cell by cell: its CRS, origin, cell and size.
/// Cells whose centres are outside the region are nodata then, those outside of a box too.
///
/// Slope, aspect and hillshade come from the 3 x 3 heights around a cell of this grid by Horn's
/// formula (B. K. P. Horn, "Hill shading and the reflectance map", doi:10.1109/PROC.1981.11918),
/// with the ground's metres per cell and heights in metres; nodata where one of the nine is. Slope
/// in degrees; aspect in degrees clockwise from north, downhill, nodata where it is level;
/// hillshade 1 to 255 (0: nodata) under a light from 315 degrees, 45 degrees high.
///
/// Tiles come in the order of a quadtree, so that a store of points is triangulated little more
/// than once. Memory: some tiles at a time within the context's bound. Reports "cells"; notes an
/// assumption about units that slopes rest on, and that no cell has data. Throws: stream::Error if
/// the region does not meet the store, or for a raster to align with that is rotated, or in a CRS
/// that is not known; UsageError for a grid of more than 2^31 columns or rows, and for `align` with
/// `cell` or another `to`.
RasterOutcome write_raster(const stream::Store& store, const RasterRequest& request,
                           const Context& context = {});

}  // namespace terrace::terrain
