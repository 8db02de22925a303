// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "terrace/tri/point_tin.hpp"

namespace terrace::tri::tin {

/// The nearest integer to a coordinate, halves up.
inline double to_whole(double place) { return std::floor(place + 0.5); }

/// The lattice height nearest to `height`.
inline double on_lattice(const TinLattice& lattice, double height) {
  return lattice.height_origin +
         to_whole((height - lattice.height_origin) / lattice.height_step) * lattice.height_step;
}

inline bool valid(const TinLattice& lattice) {
  return std::isfinite(lattice.height_origin) && std::isfinite(lattice.height_step) &&
         lattice.height_step > 0;
}

}  // namespace terrace::tri::tin
