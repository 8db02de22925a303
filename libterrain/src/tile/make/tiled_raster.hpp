// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <terrace/stream/store.hpp>

#include "earth/grid_geography.hpp"
#include "surface/store_window.hpp"
#include "tile/make/height_blocks.hpp"
#include "tile/make/tiled_store.hpp"

namespace terrace::terrain {

/// What all threads know of a raster store that is tiled.
struct TiledRaster : TiledStore {
  GridGeography geography;
  HeightBlocks blocks;
  /// Columns run along meridians, rows along parallels, at equal distances.
  bool upright = false;

  /// Reads the store twice. Throws: stream::Error if no place of it can be told on the globe.
  TiledRaster(const stream::Store& tiled, CoordinateSystem system, EllipsoidalHeights heights);

  /// The window of the lattice that has all samples in the box; empty if there is none.
  [[nodiscard]] LatticeWindow window_around(const GeographicBox& box) const;
};

}  // namespace terrace::terrain
