// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <terrace/stream/store.hpp>

#include "detail.hpp"

namespace terrace::tools {

/// A mesh in the store's CRS.
struct TriangleMesh {
  std::vector<stream::Point3> vertices;
  std::vector<std::uint8_t> levels;  ///< highest level of each vertex's point; or empty
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise seen from above
};

/// The 2D Delaunay triangulation of what `detail` wants: rasters in column and row, exactly; other
/// points in x and y. With a region, the triangles that reach into it, whole.
/// memory_bytes: what the work may take. Throws: stream::Error on a damaged store, or when the
/// points would not fit, saying what they need.
TriangleMesh mesh_of_store(const stream::Store& store, const Detail& detail,
                           std::uint64_t memory_bytes);

}  // namespace terrace::tools
