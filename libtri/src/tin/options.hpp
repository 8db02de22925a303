// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <span>
#include <stdexcept>
#include <string>

#include "terrace/tri/grid_tin.hpp"
#include "terrace/tri/point_tin.hpp"

/// Checks of arguments, and the lattice of vertices.

namespace terrace::tri::tin {

/// Throws std::invalid_argument if the window is empty or the number of heights does not match.
template <class T>
void check_shape(const GridWindow<T>& window, const std::string& function) {
  const std::size_t samples = static_cast<std::size_t>(window.columns) * window.rows;
  if (samples == 0 || window.heights.size() != samples)
    throw std::invalid_argument(function + ": a window of " + std::to_string(window.columns) +
                                " x " + std::to_string(window.rows) + " samples with " +
                                std::to_string(window.heights.size()) + " heights");
}

/// Throws as point_tin() does.
void check_point_options(const PointTinOptions& options, std::span<const Point3> frame);

/// Products of coordinates below this do not overflow.
inline constexpr double kLargest = 1e100;

inline bool valid(const TinLattice& lattice) {
  return std::isfinite(lattice.height_origin) && std::isfinite(lattice.height_step) &&
         lattice.height_step > 0;
}

/// The nearest integer to a coordinate, halves up.
inline double round_half_up(double place) { return std::floor(place + 0.5); }

/// The lattice height nearest to `height`.
inline double on_lattice(const TinLattice& lattice, double height) {
  return lattice.height_origin +
         round_half_up((height - lattice.height_origin) / lattice.height_step) *
             lattice.height_step;
}

}  // namespace terrace::tri::tin
