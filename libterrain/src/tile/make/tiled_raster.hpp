// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <terrace/stream/store.hpp>

#include "earth/grid_geography.hpp"
#include "surface/point_hull.hpp"
#include "surface/store_window.hpp"
#include "tile/make/height_blocks.hpp"
#include "tile/make/height_cache.hpp"
#include "tile/make/tiled_store.hpp"

namespace terrace::terrain {

/// What all threads share of a raster store that is tiled.
struct TiledRaster : TiledStore {
  GridGeography geography;
  HeightBlocks blocks;
  mutable HeightCache height_cache;  ///< 24 MiB per thread
  HeightBlocks::Range everywhere;    ///< of all samples
  PointHull hull;                    ///< of the samples with data, in columns and rows
  double rim = 0;                    ///< see rim_of_outline()
  /// Columns run along meridians, rows along parallels, at equal distances.
  bool upright = false;

  /// Reads the store twice. Throws: stream::Error if no place of it has a longitude and latitude.
  TiledRaster(const stream::Store& tiled, CoordinateSystem system, EllipsoidalHeights heights,
              unsigned threads);

  /// Whether a place of the lattice without a sample is within the outline of those with data: in
  /// their hull or so near that it belongs to the cells around them, as half a cell beyond the last
  /// row does, and the gap between the ends of a raster around the globe.
  [[nodiscard]] bool is_within_outline(double column, double row) const;

  /// The window of the lattice that has all samples in the box; empty if there is none.
  [[nodiscard]] LatticeWindow window_around(const GeographicBox& box) const;

  /// TileSurface::digest of a raster: of its lattice, its CRS and how it is filled; of the samples
  /// in the blocks of the lattice that the box may need; and, where samples of these are missing or
  /// the box hangs over the raster, of what fills it there. It depends on the samples and not on
  /// how the store clusters them, but for the fill, which is made of the store's level 1. The rule
  /// on what a box may need is the same as for reading it, with a margin; where it cannot be told
  /// (wide boxes of projected rasters that reach beyond the raster) it is everything. Cost: a few
  /// nanoseconds per block and per cell of the fill.
  [[nodiscard]] std::uint64_t digest(const GeographicBox& box) const;
};

}  // namespace terrace::terrain
