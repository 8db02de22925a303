// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <terrace/stream/store.hpp>

#include "earth/geography.hpp"
#include "surface/point_hull.hpp"
#include "surface/store_window.hpp"
#include "tile/make/height_blocks.hpp"
#include "tile/make/tiled_store.hpp"

namespace terrace::terrain {

/// The data that all threads share when tiling a raster store.
struct TiledRaster : TiledStore {
  GridGeography geography;
  HeightBlocks blocks;
  mutable HeightCache height_cache;  ///< 24 MiB per thread
  HeightBlocks::Range everywhere;    ///< range of all samples
  PointHull hull;                    ///< hull of the samples with data, in columns and rows
  double rim = 0;                    ///< from rim_of_outline()
  /// Whether columns are along meridians and rows along parallels, equally spaced.
  bool upright = false;

  /// Reads the store twice. Throws: stream::Error if no place of it has a longitude and latitude.
  TiledRaster(const stream::Store& tiled, CoordinateSystem system, EllipsoidalHeights heights,
              unsigned threads);

  /// Whether a place of the lattice without a sample is within the outline of the samples with
  /// data. The outline is their hull and the cells around them, such as half a cell beyond the last
  /// row and the gap between the ends of a raster around the globe.
  [[nodiscard]] bool is_within_outline(double column, double row) const;

  /// Returns the window of the lattice with all samples in the box; empty if there is none.
  [[nodiscard]] LatticeWindow window_around(const GeographicBox& box) const;

  /// Implements TileSurface::digest() for a raster. Hashes the lattice, the CRS, the kind of fill,
  /// and the samples in the blocks of the lattice that the box may need. If some of these are
  /// missing or the box extends beyond the raster, it also hashes the fill there. Depends on the
  /// samples, not on how the store clusters them, except for the fill, which is made from the
  /// store's level 1. The rule for what a box may need is the same as for reading it, with a
  /// margin. If that cannot be determined (wide boxes of projected rasters that extend beyond the
  /// raster), it hashes everything. Cost: a few nanoseconds per block and per cell of the fill.
  [[nodiscard]] std::uint64_t digest(const GeographicBox& box) const;
};

}  // namespace terrace::terrain
