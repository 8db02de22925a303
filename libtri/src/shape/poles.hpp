// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "spheres.hpp"

/// The poles rule, see ShapeRule::kPoles: which tetrahedra are inside, by the strongest evidence
/// among angles between circumspheres.

namespace terrace::tri::shape {

/// How much heavier the angle at a vertex weighs than that across a facet.
inline constexpr double kPoleWeight = 2.0;

/// What is known where the tetrahedra are a part of all, by slot.
struct Part {
  std::span<const std::uint8_t> label;  ///< of tetrahedra: 1 outside, 2 inside, 0 unknown
  std::size_t unlabelled = 0;           ///< the number of unknown ones, which come first
  std::span<const std::uint8_t> whole;  ///< of vertices: whether all tetrahedra at them are here
};

/// The first step: labels by tetrahedron slot, 1 inside, 0 outside or not finite. The nodes are the
/// finite tetrahedra, and one for all space beyond the hull. A facet says that both of its sides
/// are alike, the more credibly the less its defect; a vertex says that its two poles (the largest
/// circumspheres on either side, N. Amenta, M. Bern, doi:10.1007/PL00009475) are of different
/// sides. Of these statements a spanning forest of least defect is believed (found by Boruvka's
/// rounds).
///
/// In a part the vertices of unknown tetrahedra are whole. If the known labels are those of the
/// whole forest, so are the others: joining tetrahedra by their right labels in advance closes no
/// cycle against them.
///
/// O(n log n); memory 60 bytes per tetrahedron, freed at the end, besides the spheres.
std::vector<std::uint8_t> signed_forest(const Spheres& spheres, unsigned threads,
                                        const Part& part = {});

/// The second and the third step.
///
/// 2. Flips tetrahedra whose facets contradict their label by more than they support it, the
/// strongest first. No vertex loses its last tetrahedron of a label.
///
/// 3. Gives vertices that all tetrahedra around them call inside, or outside, a facet of the
/// surface. Each flips a tetrahedron whose facet opposite to the vertex is on the surface, the one
/// with the least defect first; this changes neither the topology of the surface nor the vertices
/// on it otherwise.
///
/// In a part only tetrahedra between whole vertices are flipped.
void smooth_and_sculpt(const Spheres& spheres, std::vector<std::uint8_t>& inside,
                       const Part& part = {});

}  // namespace terrace::tri::shape
