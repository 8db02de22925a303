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

/// The first step: labels by tetrahedron slot, 1 inside, 0 outside or not finite. The nodes are the
/// finite tetrahedra, and one for all space beyond the hull. A facet says that both of its sides
/// are alike, the more credibly the less its defect; a vertex says that its two poles (the largest
/// circumspheres on either side, N. Amenta, M. Bern, doi:10.1007/PL00009475) are of different
/// sides. Of these statements a spanning forest of least defect is believed (Kruskal).
///
/// O(n log n); memory 60 bytes per tetrahedron, freed at the end.
std::vector<std::uint8_t> signed_forest(const Spheres& spheres, unsigned threads);

/// The second step: flips tetrahedra whose facets contradict their label by more than they support
/// it, the strongest first. No vertex loses its last tetrahedron of a label.
void smooth(const Spheres& spheres, std::vector<std::uint8_t>& inside);

/// The third step: gives vertices that all tetrahedra around them call inside, or outside, a facet
/// of the surface. Each flips a tetrahedron whose facet opposite to the vertex is on the surface,
/// the one with the least defect first; this changes neither the topology of the surface nor the
/// vertices on it otherwise.
void sculpt(const Spheres& spheres, std::vector<std::uint8_t>& inside);

}  // namespace terrace::tri::shape
