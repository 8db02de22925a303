// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "terrace/terrain/context.hpp"
#include "tile/format/tile_address.hpp"
#include "tile/make/tile_surface.hpp"

namespace terrace::terrain {

/// The tiles of a zoom that may have samples, sorted by row, then column. Found from zoom 0 down,
/// so that it costs by these tiles, however far apart the samples lie. Throws: stream::Stopped.
std::vector<TileAddress> tiles_with_samples(TileSurface& surface, unsigned zoom,
                                            const Context& context);

}  // namespace terrace::terrain
