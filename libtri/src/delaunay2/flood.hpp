// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mesh.hpp"

namespace terrace::tri::planar {

/// Values of Mesh::mark.
inline constexpr std::uint8_t kKept = 0;
inline constexpr std::uint8_t kRemoved = 1;
inline constexpr std::uint8_t kOnBoundary = 2;

/// In Triangle::corner[0], between flood() and dry(): the triangle is part of the region.
inline constexpr std::uint32_t kInRegion = 0x80000000u;

/// Finds the region that removed vertices leave: all triangles at them, and the edges round these.
/// region.removed: the vertices, kRemoved in Mesh::mark, where all others are kKept. Fills
/// region.triangles, .mixed and .boundary; the triangles bear kInRegion.
///
/// The region is flooded across edges breadth-first, so that a triangle is fetched from memory long
/// before its turn comes, and almost without branches, which nothing could foresee. (Turning round
/// each vertex visits each triangle three times, one after the other.) O(triangles).
template <class Kernel>
void flood(Mesh<Kernel>& mesh);

/// Takes kInRegion from the region's triangles.
template <class Kernel>
void dry(Mesh<Kernel>& mesh);

}  // namespace terrace::tri::planar
