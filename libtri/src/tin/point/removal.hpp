// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh.hpp"
#include "star.hpp"

namespace terrace::tri::tin::points {

/// By the first terms of the series: results must not depend on a library's tangent. Exact to
/// 1e-9 up to 30 degrees.
double tangent_of(double degrees);

/// One pass over the vertices in the order of their numbers, `fixed` first ones left out: each is
/// removed if the hole can be filled so that every sample in it stays within the bound, with the
/// Delaunay triangles, else with the triangulation of least worst error whose angles are at least
/// min_angle_degrees. Lists must be complete; afterwards they are so again. Returns the number of
/// vertices removed: they are in no triangle.
std::size_t remove_vertices(Mesh& mesh, std::size_t fixed, double bound, double min_angle_degrees);

/// One sweep over the vertices: each is moved up or down to the middle of the heights that keep the
/// samples of its star within the bound (the nearest height of the lattice, if there is one).
/// The samples of vertices must be listed.
void fit_heights(Mesh& mesh, std::size_t fixed, double bound,
                 const std::optional<TinLattice>& lattice);

}  // namespace terrace::tri::tin::points
