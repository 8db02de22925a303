// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/interpolation.hpp"

/// Smoothing of heights. The result is an overlay, a list of changed heights; nothing else changes.

namespace terrace::tri {

enum class Smoothing : std::uint8_t {
  /// Every height moves towards the weighted mean of its neighbours. Flattens hills in time.
  kLaplacian,
  /// G. Taubin, "A signal processing approach to fair surface design", doi:10.1145/218380.218473: a
  /// step towards the mean, then a slightly larger one away from it. What is rough goes, what is
  /// wide stays as high as it was.
  kTaubin,
  /// Only neighbours of similar height count, so that steps stay steps: Tukey's
  /// biweight, (1 - (d / edge_height)^2)^2 for differences d below edge_height, else 0. C. Tomasi,
  /// R. Manduchi, "Bilateral filtering for gray and color images", doi:10.1109/ICCV.1998.710815.
  kBilateral,
};

struct SmoothingOptions {
  Smoothing method = Smoothing::kLaplacian;
  unsigned iterations = 10;
  /// The part of the way to the mean that a step goes: 0 < strength <= 1 (kTaubin: about 0.6).
  double strength = 0.5;
  /// kTaubin: the pass band in units of the Laplacian's eigenvalues (0 to 2); below it amplitudes
  /// grow a little, above it they shrink. 0 < pass_band < 1.
  double pass_band = 0.1;
  /// kBilateral: see there. > 0, in the unit of heights.
  double edge_height = 0;
};

struct HeightChange {
  VertexId vertex = kNoVertex;
  double height = 0;
};

/// New heights of the vertices of `region` that may move, in ascending order of slots. Those at the
/// region's border, which have a neighbour outside it or lie on the hull, stay; so does a vertex
/// whose triangles are so thin that doubles cannot tell their angles.
///
/// Neighbours are weighted by the length of the side between two Voronoi cells over the distance
/// (in the plane). So planes stay planes for kLaplacian and kTaubin, however irregular the points;
/// for kBilateral where neighbours lie symmetrically, as on grids. kLaplacian and kBilateral never
/// leave the range of heights in the region.
///
/// All steps read the heights of the step before: the order of vertices does not matter. O(vertices
/// of the region * iterations); 16 bytes per edge inside.
///
/// Throws std::invalid_argument for options out of range or that would make heights grow without
/// bound, for a height in the region that is not finite, and if an array of heights is shorter than
/// vertex_slots().
template <class Coord>
std::vector<HeightChange> smooth(const Delaunay2<Coord>& triangulation, const Heights& heights,
                                 std::span<const VertexId> region, const SmoothingOptions& options);

/// The vertices in a closed box, in ascending order of slots. O(n).
template <class Coord>
std::vector<VertexId> vertices_in(const Delaunay2<Coord>& triangulation, const Box3& box) {
  std::vector<VertexId> result;
  for (const VertexId vertex : triangulation.all_vertices()) {
    const auto p = triangulation.point(vertex);
    const auto x = static_cast<double>(p[0]);
    const auto y = static_cast<double>(p[1]);
    if (box.min[0] <= x && x <= box.max[0] && box.min[1] <= y && y <= box.max[1])
      result.push_back(vertex);
  }
  return result;
}

extern template std::vector<HeightChange> smooth(const Delaunay2<std::int32_t>&, const Heights&,
                                                 std::span<const VertexId>,
                                                 const SmoothingOptions&);
extern template std::vector<HeightChange> smooth(const Delaunay2<double>&, const Heights&,
                                                 std::span<const VertexId>,
                                                 const SmoothingOptions&);

}  // namespace terrace::tri
