// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <terrace/stream/mesh_writer.hpp>

namespace terrace::terrain {

/// What is to be meshed to so that a reader of the file sees no more than the bound. Heights move
/// by what they are rounded by, which is known, and a little with the places, which depends on how
/// steep the surface is.
struct Aim {
  double first = 0.0;  ///< allows for nearly nothing of that: to be tried, and checked
  double sure = 0.0;   ///< where the first misses the bound, and where nobody can check
};
/// Both are the bound if the format is exact. path: named in errors.
/// Throws: stream::Error if the file's format rounds too coarsely for the bound.
Aim aim_within(double bound, const stream::MeshRounding& rounding, const std::string& path);

}  // namespace terrace::terrain
