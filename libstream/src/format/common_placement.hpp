// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>

#include "terrace/stream/point.hpp"
#include "terrace/stream/schema.hpp"

/// One placement for the points of several files, because a source has only one: integer
/// coordinates of LAS and EPT files with different scales or offsets move onto a common lattice.

namespace terrace::stream {

/// Returns a placement that holds the points of all `placements`, of which there is at least one:
/// 1. The first one, if all are equal.
/// 2. Otherwise the coarsest lattice of 32-bit integers that contains all of theirs. It may differ
///    from them by a ten-thousandth of its step, because offsets are doubles.
/// 3. Coordinates of the CRS as doubles, if the lattices have no common refinement, or if 32 bits
///    do not cover `bounds`.
///
/// bounds: the bounding box of the points, in the CRS; empty if unknown.
Placement common_placement(std::span<const Placement> placements, const Box3& bounds);

/// Moves stored coordinates to another placement: c * factor + shift.
struct Move {
  Point3 factor{1, 1, 1}, shift{0, 0, 0};
};
/// Returns the move from one placement to another, which is in whole steps between lattices.
/// Throws: std::domain_error, naming the axis, if the points of `from` are not on the lattice `to`.
Move move_between(const Placement& from, const Placement& to);

}  // namespace terrace::stream
