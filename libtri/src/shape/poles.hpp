// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "spheres.hpp"
#include "state.hpp"

/// The poles rule, see ShapeRule::poles: decides which tetrahedra are inside by the strongest
/// evidence among the angles between circumspheres.

namespace terrace::tri::shape {

/// Weight of the angle at a vertex relative to the angle across a facet.
inline constexpr double kPoleWeight = 2.0;

/// The known labels and vertices, by slot, if the tetrahedra are only a part of all.
struct Part {
  std::span<const std::uint8_t> label;     ///< labels of tetrahedra: 1 outside, 2 inside, 0 unknown
  std::size_t unlabelled = 0;              ///< the number of unknown ones, which come first
  std::span<const std::uint8_t> complete;  ///< by vertex: 1 if all its tetrahedra are in the part
};

/// The first step: returns labels by tetrahedron slot, 1 inside, 0 outside or not finite. The nodes
/// are the finite tetrahedra, and one for all space beyond the hull. The edges are signed: a facet
/// says that its two sides have the same label, a vertex that its two poles (the largest
/// circumspheres on either side, N. Amenta, M. Bern, doi:10.1007/PL00009475) have different labels.
/// The smaller its defect, the more credible is an edge. The labels are those of a minimum spanning
/// forest, which Boruvka's algorithm finds.
///
/// In a part, the vertices of unknown tetrahedra are complete. If the known labels are those of the
/// whole forest, so are the others: joining tetrahedra by their right labels in advance does not
/// close a cycle that contradicts them.
///
/// O(n log n). Memory: 60 bytes per tetrahedron, freed at the end, besides the spheres.
std::vector<std::uint8_t> signed_forest(const Spheres& spheres, unsigned threads,
                                        const Part& part = {},
                                        const base::StopCheck& check_stop = {});

/// Number of tetrahedra outside and inside at every vertex, by slot. Ghosts are outside.
using LabelCounts = std::vector<std::array<std::uint32_t, 2>>;

/// The second and the third step. Returns the counts after them.
///
/// 2. Flips tetrahedra whose facets contradict their label by more than they support it, the
/// strongest first. No vertex loses its last tetrahedron of a label.
///
/// 3. Gives a facet of the surface to vertices whose tetrahedra are all labelled inside, or all
/// outside. Each such vertex flips a tetrahedron whose facet opposite to the vertex is on the
/// surface, the one with the least defect first. Otherwise this changes neither the topology of the
/// surface nor the vertices on it.
///
/// In a part, only tetrahedra between complete vertices are flipped.
LabelCounts smooth_and_sculpt(const Spheres& spheres, std::vector<std::uint8_t>& inside,
                              const Part& part = {}, const base::StopCheck& check_stop = {});

/// Computes the state of the poles rule from scratch. Vertices that are not on the surface are
/// lost. Requires a scope of the metric.
template <class Mesh>
void restore_by_poles(const Mesh& mesh, State& state, unsigned threads,
                      const base::StopCheck& check_stop) {
  base::StopTicks ticks(check_stop);
  std::vector<Place> places = places_of(mesh);
  ticks.look();
  const Renumbered ordered = in_order_of_vertices(
      std::span(mesh.tetrahedron.data(), mesh.tetrahedron.size()), places, threads);
  const Spheres spheres(span_of(ordered.tetrahedra), std::move(places), threads, check_stop);
  const std::vector<std::uint8_t> forest = signed_forest(spheres, threads, {}, check_stop);
  std::vector<std::uint8_t> inside = forest;
  const LabelCounts counts = smooth_and_sculpt(spheres, inside, {}, check_stop);
  state.of.assign(mesh.tetrahedron.size(), kAbsent);
  state.forest.assign(mesh.tetrahedron.size(), 0);
  state.kept_count = 0;
  for (std::uint32_t t = 0; t < mesh.tetrahedron.size(); ++t) {
    if (mesh.tetrahedron[t].corner[0] == spatial::kFreeCorner) continue;
    const std::uint32_t n = ordered.number[t];
    if (!spheres.finite(n)) continue;
    state.forest[t] = forest[n];
    state.of[t] = inside[n] != 0 ? kKept : 0;
    state.kept_count += inside[n];
  }
  state.degree.assign(mesh.vertex.size(), 0);
  state.lost.clear();
  state.rescued.clear();
  for (std::uint32_t v = 1; v < mesh.vertex.size(); ++v) {
    state.degree[v] = counts[v][1];
    if (!mesh.flat && mesh.vertex_alive(v) && (counts[v][0] == 0 || counts[v][1] == 0))
      state.lost.push_back(v);
  }
}

}  // namespace terrace::tri::shape
