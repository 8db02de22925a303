// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/terrain/triangle_mesh.hpp"

namespace terrace::terrain {

/// Returns a vector along the normal of the triangle with the length of twice its area.
stream::Point3 area_vector(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t);

/// True if the mesh has no overlaps seen from above: nearly all triangles, seen along z, have the
/// same orientation. False for a point cloud.
bool is_height_field(const TriangleMesh& mesh, const base::StopCheck& check_stop = {});

/// Whether more than half of the surface is steeper than 60 degrees, as in triangles between the
/// upper and the lower side of a body that was triangulated as if it were terrain.
bool mostly_steep(const TriangleMesh& mesh, const base::StopCheck& check_stop = {});

/// Square root of the mean squared slope (rise over run) of the triangles, weighted by their area
/// seen from above.
double rms_slope(const TriangleMesh& mesh, const base::StopCheck& check_stop = {});

/// Returns a sample of about 100,000 of `heights` (one per vertex), evenly distributed over the
/// area of the surface (with `flat` as seen from above), so that dense parts do not dominate. For a
/// cloud from a store it is even over the parts of space with points; for other clouds, over the
/// points. O(triangles + points).
std::vector<double> shown_heights(const TriangleMesh& mesh, const std::vector<double>& heights,
                                  bool flat, const base::StopCheck& check_stop = {});

/// Returns unit normals at the vertices: those of the adjacent triangles, weighted by area. For a
/// height field they point up.
std::vector<std::array<float, 3>> vertex_normals(const TriangleMesh& mesh,
                                                 const base::StopCheck& check_stop = {});

}  // namespace terrace::terrain
