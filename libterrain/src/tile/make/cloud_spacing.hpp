// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <terrace/stream/store.hpp>

#include "tile/make/stored_places.hpp"

namespace terrace::terrain {

/// Returns the typical spacing of a store's points in degrees of latitude: the spacing of a square
/// lattice with the density around the median point. Estimated from the points in and around 32
/// clusters; points at one x and y count once. If all are at one place, returns 180 / 64. Throws:
/// stream::Error on a damaged store.
double cloud_spacing(const stream::Store& store, const StoredPlaces& places);

}  // namespace terrace::terrain
