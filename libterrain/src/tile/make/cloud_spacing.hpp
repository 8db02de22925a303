// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <terrace/stream/store.hpp>

#include "tile/make/stored_places.hpp"

namespace terrace::terrain {

/// How far apart the points of a store are where most of them lie, in degrees of latitude: the
/// distance on a square lattice of the density around the median point. From the points in and
/// around 32 clusters; of points at one x, y one counts. Where all have one place, that of two
/// zooms of tiles: 180 / 64. Throws: stream::Error on a damaged store.
double cloud_spacing(const stream::Store& store, const StoredPlaces& places);

}  // namespace terrace::terrain
