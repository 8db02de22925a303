// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <stdexcept>

#include <terrace/tri/point_tin.hpp>

#include "tile/format/address.hpp"
#include "tile/format/quantized_mesh.hpp"
#include "tile/make/sides.hpp"
#include "tile/make/surface.hpp"

namespace terrace::terrain {

struct TileMeshOptions {
  tri::TinQuality quality = tri::TinQuality::removal;
  bool normals = false;  ///< add the oct-encoded normals extension
  bool water = false;    ///< add the water mask extension
};

/// A tile's mesh and header, and its largest distance from the samples.
struct BuiltTile {
  TileMesh mesh;
  TileHeader header;
  double max_error = 0.0;  ///< in metres, as decoded by a client; never too small
  bool has_data = false;   ///< whether a sample is in the tile
};

/// Thrown if a tile's range of heights needs more than kTileUnits steps of plan.height_step, or a
/// height is beyond 2^24 steps. The caller then uses larger steps.
class HeightRangeTooLarge : public std::runtime_error {
 public:
  HeightRangeTooLarge() : std::runtime_error("the heights of a tile need larger steps") {}
};

/// Meshes a tile within plan.max_error of every sample, with positions and heights rounded as a
/// client decodes them. If rounding alone exceeds the bound, the result's max_error exceeds
/// plan.max_error. Depends only on the arguments; the borders of the tile depend only on the plan
/// and the surface along them. `shared`: border sides kept for neighbouring tiles of the same zoom;
/// may be null. Holds the samples of one leaf at a time. Throws: HeightRangeTooLarge; stream::Error
/// on a damaged store.
BuiltTile make_tile(const TileAddress& tile, const ZoomPlan& plan, TileSurface& surface,
                    const TileMeshOptions& options, SharedSides* shared = nullptr);

}  // namespace terrace::terrain
