// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include <terrace/stream/store.hpp>

#include "earth/geoid_heights.hpp"
#include "earth/grid_geography.hpp"
#include "surface/raster_fill.hpp"
#include "surface/store_window.hpp"
#include "terrace/terrain/crs.hpp"
#include "tile/format/tile_address.hpp"
#include "tile/make/height_blocks.hpp"

namespace terrace::terrain {

/// What all threads know of a raster store that is tiled.
struct TiledRaster {
  stream::Store store;
  CoordinateSystem crs;
  stream::Placement placement;
  GridGeography geography;
  EllipsoidalHeights vertical;
  /// Heights where there is no data: nothing takes those around, else this height in metres.
  std::optional<double> flat_fill{};
  /// A sample of this height (in the store's unit) is water; without, one that has no data is.
  std::optional<double> water_height{};

  RasterFill fill;
  HeightBlocks blocks;
  GeographicBox bounds{};
  double spacing = 0.0;
  /// Range of the longitudes that a raster in degrees gives its samples; may go beyond 180.
  double first_longitude = 0.0, last_longitude = 0.0;
  /// Columns run along meridians, rows along parallels, at equal distances.
  bool upright = false;

  /// Reads the store twice. Throws: stream::Error if no place of it can be told on the globe.
  TiledRaster(const stream::Store& tiled, CoordinateSystem system, EllipsoidalHeights heights);
};

/// A place of the lattice, between samples too, in the raster's CRS.
Point2 world_place(const stream::Placement& placement, double column, double row);
/// Longitudes in [-180, 180], whatever turn they were in.
double wrapped(double longitude);
/// Places on the globe to those of the raster's lattice, in place.
void find_on_lattice(const TiledRaster& raster, std::span<Point2> places);
/// The window of the raster that has all its samples in the box; empty if there is none.
LatticeWindow window_around(const TiledRaster& raster, const GeographicBox& box);

}  // namespace terrace::terrain
