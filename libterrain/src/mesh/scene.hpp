// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "terrace/terrain/triangle_mesh.hpp"

namespace terrace::terrain {

/// Twice the area along the normal of the triangle.
stream::Point3 area_vector(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t);

/// True if the mesh is seen from above without overlap: nearly all triangles, seen along z, turn
/// the same way. False for a cloud of points.
bool is_height_field(const TriangleMesh& mesh);

/// Whether more than half of the surface is steeper than 60 degrees: triangles between the upper
/// and the lower side of a body that was triangulated as if it were a terrain.
bool mostly_steep(const TriangleMesh& mesh);

/// Square root of the mean squared slope (rise over run) of the triangles, weighed by their area as
/// seen from above.
double rms_slope(const TriangleMesh& mesh);

/// A sample of about 100,000 of `heights` (one per vertex), even over the area of the surface (with
/// `flat` as seen from above), so that dense parts count no more than others. For a cloud out of a
/// store: even over the parts of space that have points; for other clouds: over the points.
/// O(triangles + points).
std::vector<double> shown_heights(const TriangleMesh& mesh, const std::vector<double>& heights,
                                  bool flat);

/// Unit normals at the vertices: those of the triangles around, weighed by area. For a height field
/// they point up.
std::vector<std::array<float, 3>> vertex_normals(const TriangleMesh& mesh);

}  // namespace terrace::terrain
