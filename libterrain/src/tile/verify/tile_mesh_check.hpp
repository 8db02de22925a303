// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tile/format/quantized_mesh.hpp"
#include "tile/format/tile_address.hpp"

namespace terrace::terrain {

/// A fault in a tile: the byte (after decompression, if it is compressed), and what is wrong.
struct TileFault {
  std::uint64_t offset = 0;
  std::string what;
};

/// Checks a tile by itself: triangles are counter-clockwise, have an area and cover the square
/// once; all corners exist and no vertex is unused; lists of border vertices are exact and sorted;
/// sphere, centre and horizon occlusion point of the header are sound; normals point upward; and it
/// has exactly the extensions that `extensions` (of layer.json) promises. Reports the first fault
/// of each kind and counts them all. O(n log n).
std::vector<TileFault> check_tile_mesh(const TileAddress& address, const DecodedTile& tile,
                                       const std::vector<std::string>& extensions);

}  // namespace terrace::terrain
