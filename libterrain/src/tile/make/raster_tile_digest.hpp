// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "tile/format/tile_address.hpp"

namespace terrace::terrain {

struct TiledRaster;

/// TileSurface::digest of a raster: of its lattice, its CRS and how it is filled; of the samples in
/// the blocks of the lattice that the box may need; and, where samples of these are missing or the
/// box hangs over the raster, of what fills it there. It depends on the samples and not on how the
/// store clusters them, but for the fill, which is made of the store's level 1. The rule on what a
/// box may need is the same as for reading it, with a margin; where it cannot be told (wide boxes
/// of projected rasters that reach beyond the raster) it is everything. Cost: a few nanoseconds per
/// block and per cell of the fill.
std::uint64_t digest_of(const TiledRaster& raster, const GeographicBox& box);

}  // namespace terrace::terrain
