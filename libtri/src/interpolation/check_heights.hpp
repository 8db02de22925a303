// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

#include "terrace/tri/interpolation.hpp"

namespace terrace::tri {

/// Throws std::invalid_argument if an array of heights is too short.
template <class Coord>
void check_heights(const Delaunay2<Coord>& triangulation, const Heights& heights) {
  if (heights.slots() >= triangulation.vertex_slots()) return;
  throw std::invalid_argument("heights: " + std::to_string(heights.slots()) +
                              " values for vertices in " +
                              std::to_string(triangulation.vertex_slots()) +
                              " slots; give as many as vertex_slots(), indexed by slot()");
}

}  // namespace terrace::tri
