// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>

#include "terrace/stream/point.hpp"
#include "terrace/stream/schema.hpp"

/// One placement for the points of several files, as one source has one: integers of LAS and EPT
/// whose scales or offsets differ come onto a common lattice.

namespace terrace::stream {

/// A placement that holds the points of all of `placements`, which are not empty: theirs if they
/// are equal; else the coarsest lattice of 32-bit integers on which those of all lie, to a
/// ten-thousandth of its step (offsets as doubles resolve a millimetre of projected coordinates to
/// a millionth); the first one's if it will do. Where lattices do not meet within a fraction of
/// their steps, or 32 bits do not reach all of `bounds`, coordinates of the CRS as doubles.
/// bounds: of the points, in the CRS; empty if unknown.
Placement common_placement(std::span<const Placement> placements, const Box3& bounds);

/// Moves stored coordinates to another placement: c * factor + shift.
struct Move {
  Point3 factor{1, 1, 1}, shift{0, 0, 0};
};
/// The move from one placement to another; between lattices in whole steps. Throws:
/// std::domain_error, naming the axis, if the points of `from` are not on the lattice `to`.
Move move_between(const Placement& from, const Placement& to);

}  // namespace terrace::stream
