// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "tile/format/quantized_mesh.hpp"
#include "tile/format/tile_address.hpp"
#include "tile/verify/tile_mesh_check.hpp"

namespace terrace::terrain {

/// What is wrong in a tile's header: the sphere holds all vertices and is not wider than its centre
/// asks for, the centre lies in the tile, the horizon occlusion point is not hidden while a vertex
/// is seen, and not farther out than that takes. The tile has a vertex. O(n).
std::vector<TileFault> check_tile_header(const TileAddress& address, const DecodedTile& tile);

}  // namespace terrace::terrain
