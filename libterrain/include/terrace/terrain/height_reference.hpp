// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace terrace::terrain {

/// The assumed reference of a store's heights when heights above the ellipsoid are needed, as on a
/// globe.
enum class HeightReference : std::uint8_t {
  recorded,     ///< as the store says; if not the ellipsoid, a geoid grid must be given
  ellipsoidal,  ///< the ellipsoid, whatever the store says
  orthometric,  ///< sea level: by the store's vertical CRS, or by EGM96 if it has none
  ignore,       ///< the ellipsoid, although it is wrong: off by up to about 100 m
};

}  // namespace terrace::terrain
