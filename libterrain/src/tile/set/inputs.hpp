// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "tile/format/address.hpp"
#include "tile/make/mesher.hpp"
#include "tile/make/sides.hpp"
#include "tile/make/surface.hpp"

namespace terrace::terrain {

/// The inputs that determine a tile's bytes, in addition to its zoom's plan and the surface.
struct TileInputs {
  TileMeshOptions mesh;
  bool gzip = false;
  std::string source_options;  ///< the options that the surface depends on
  std::string metadata;        ///< metadata of this tile
};

/// Returns a box with all places at which make_tile() may query a surface: the tile and a margin.
/// May extend beyond 180 degrees and the poles.
GeographicBox input_box(const TileAddress& tile, const TileSurface& surface);

/// Returns a hash of everything that a tile's bytes, or its absence for lack of data, depend on.
/// The tile is up to date while the hash stays the same.
std::uint64_t digest_of(const TileAddress& tile, const ZoomPlan& plan, const TileInputs& inputs,
                        TileSurface& surface);

/// Returns a hash of the bytes of a file. Throws: stream::Error if it cannot be read.
std::uint64_t digest_of_file(const std::string& path);

}  // namespace terrace::terrain
