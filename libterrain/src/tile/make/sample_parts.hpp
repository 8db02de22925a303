// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "terrace/terrain/context.hpp"
#include "tile/format/tile_address.hpp"
#include "tile/make/tile_surface.hpp"

/// Boxes and tiles that have samples; boxes of any number of samples, part by part.

namespace terrace::terrain {

/// The four parts of a box, from the south-west on.
std::array<GeographicBox, 4> quarters_of(const GeographicBox& box);
/// Whether a box may have samples.
bool may_have_samples(const GeographicBox& box, TileSurface& surface);
/// Whether the samples of a box are too many to be asked for at once.
bool is_to_be_cut(const GeographicBox& box, TileSurface& surface);

/// Calls visit with the samples of parts of a box, part after part. Those where parts meet come
/// once: a part has those on its eastern and northern side only where it ends with the box. Memory:
/// of one part.
void for_each_part(const GeographicBox& box, TileSurface& surface,
                   const std::function<void(const SurfaceSamples&)>& visit);

/// The tiles of a zoom that may have samples, sorted by row, then column. Searched from zoom 0
/// down, so the cost is proportional to these tiles however far apart the samples lie. Throws:
/// stream::Stopped.
std::vector<TileAddress> tiles_with_samples(TileSurface& surface, unsigned zoom,
                                            const Context& context);

}  // namespace terrace::terrain
