// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "terrace/terrain/tiles.hpp"
#include "tile/make/tile_mesher.hpp"

namespace terrace::terrain {

/// A request, and what it becomes with the store at hand.
struct TileSetOptions {
  const TilesRequest& request;
  std::string folder;  ///< where links lead
  unsigned last_zoom = 0;
  std::string source_options;  ///< those that the surface depends on

  [[nodiscard]] TileMeshOptions mesh() const {
    return {request.quality, request.normals, request.water};
  }
  /// The bound of a zoom, metres.
  [[nodiscard]] double max_error(unsigned zoom) const;
};

}  // namespace terrace::terrain
