// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace terrace::terrain {

/// What a store's heights are taken to be measured from where heights above the ellipsoid are
/// wanted, as on a globe.
enum class HeightReference : std::uint8_t {
  recorded,     ///< what the store says; not the ellipsoid: a geoid grid has to be given
  ellipsoidal,  ///< the ellipsoid, whatever the store says
  orthometric,  ///< the sea: by the store's vertical CRS, or by EGM96 if it has none
  ignore,       ///< the ellipsoid though it is not: heights are off by up to about 100 m
};

}  // namespace terrace::terrain
