// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "terrace/terrain/context.hpp"
#include "tile/format/address.hpp"
#include "tile/make/surface.hpp"

/// Finds boxes and tiles with samples, and processes large boxes part by part.

namespace terrace::terrain {

/// Returns the four parts of a box, from the south-west on.
std::array<GeographicBox, 4> quarters_of(const GeographicBox& box);
/// Whether a box may have samples.
bool may_have_samples(const GeographicBox& box, TileSurface& surface);
/// Whether a box has too many samples to request at once.
bool is_to_be_cut(const GeographicBox& box, TileSurface& surface);

/// Calls visit with the samples of parts of a box, one part after another. Samples on shared sides
/// are passed once: a part includes its eastern and northern side only at the end of the box.
/// Memory: for one part.
void for_each_part(const GeographicBox& box, TileSurface& surface,
                   const std::function<void(const SurfaceSamples&)>& visit);

/// Returns the tiles of a zoom that may have samples, sorted by row, then column. Searches from
/// zoom 0 down, so the cost is proportional to the number of these tiles, even if the samples are
/// far apart. Throws: stream::Stopped.
std::vector<TileAddress> tiles_with_samples(TileSurface& surface, unsigned zoom,
                                            const Context& context);

}  // namespace terrace::terrain
