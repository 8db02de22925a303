// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh.hpp"
#include "star.hpp"

namespace terrace::tri::tin::points {

/// Passes once over the vertices in the order of their numbers, except for the first `fixed`.
/// Removes each one whose hole can be filled so that every sample in it stays within the bound,
/// either with the Delaunay triangles or with the triangulation of least worst error whose angles
/// are at least min_angle_degrees. Requires complete lists and keeps them complete. Returns the
/// number of vertices removed, which remain as vertices without triangles.
std::size_t remove_vertices(Mesh& mesh, std::size_t fixed, double bound, double min_angle_degrees);

/// Sweeps once over the vertices. Moves each one up or down to the middle of the heights that keep
/// the samples of its star within the bound, rounded to the lattice if there is one. Requires the
/// samples of vertices to be listed.
void fit_heights(Mesh& mesh, std::size_t fixed, double bound,
                 const std::optional<TinLattice>& lattice);

}  // namespace terrace::tri::tin::points
