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
  bool normals = false;
  bool water = false;
};

/// A tile's mesh and header, and its largest distance from the samples.
struct BuiltTile {
  TileMesh mesh;
  TileHeader header;
  double max_error = 0.0;  ///< in metres, as decoded by a client; never too small
  bool has_data = false;   ///< whether a sample is in the tile
};

/// Thrown if the heights of a tile do not fit in the steps of its zoom. The caller then uses larger
/// steps.
class HeightsTooFar : public std::runtime_error {
 public:
  HeightsTooFar() : std::runtime_error("the heights of a tile need larger steps") {}
};

/// Meshes a tile within plan.max_error of every sample, with positions and heights rounded as a
/// client decodes them. If the rounding itself is coarser than the bound, max_error contains the
/// actual error. Depends only on the arguments; the borders of the tile depend only on the plan and
/// the surface along them. shared: of the zoom, or null. Memory: for the samples of one leaf,
/// whatever the tile contains. Throws: HeightsTooFar; stream::Error on a damaged store.
BuiltTile make_tile(const TileAddress& tile, const ZoomPlan& plan, TileSurface& surface,
                    const TileMeshOptions& options, SharedSides* shared = nullptr);

}  // namespace terrace::terrain
