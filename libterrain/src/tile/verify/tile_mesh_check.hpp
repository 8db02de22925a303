// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tile/format/quantized_mesh.hpp"
#include "tile/format/tile_address.hpp"

namespace terrace::terrain {

/// What is wrong in a tile: at which byte (of the unpacked ones, if it is compressed), and what.
struct TileFault {
  std::uint64_t offset = 0;
  std::string what;
};

/// Checks a tile by itself: triangles counter-clockwise and with an area, that cover the square
/// once; all corners there, no vertex unused; lists of border vertices exact and sorted; sphere,
/// centre and horizon occlusion point of the header; normals upward; the extensions that
/// `extensions` (of layer.json) promises and no others. Of each kind of fault the first is named
/// and all are counted. O(n log n).
std::vector<TileFault> check_tile_mesh(const TileAddress& address, const DecodedTile& tile,
                                       const std::vector<std::string>& extensions);

}  // namespace terrace::terrain
