// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/interpolation.hpp"

/// Smooths heights. The result is an overlay: a list of changed heights.

namespace terrace::tri {

enum class Smoothing : std::uint8_t {
  /// Moves every height towards the weighted mean of its neighbours. Many iterations flatten hills.
  laplacian,
  /// Takes a step towards the mean, then a slightly larger one away from it (G. Taubin, "A signal
  /// processing approach to fair surface design", doi:10.1145/218380.218473). Removes roughness and
  /// preserves the height of wide features.
  taubin,
  /// Counts only neighbours of similar height, which preserves steps. The weight is Tukey's
  /// biweight, (1 - (d / edge_height)^2)^2 for differences d below edge_height, else 0. C. Tomasi,
  /// R. Manduchi, "Bilateral filtering for gray and color images", doi:10.1109/ICCV.1998.710815.
  bilateral,
};

struct SmoothingOptions {
  Smoothing method = Smoothing::laplacian;
  unsigned iterations = 10;
  /// Fraction of the way to the mean that a step goes, 0 < strength <= 1 (about 0.6 suits
  /// `taubin`).
  double strength = 0.5;
  /// taubin: the pass band in units of the Laplacian's eigenvalues (0 to 2). Amplitudes below it
  /// grow slightly, those above it shrink. 0 < pass_band < 1.
  double pass_band = 0.1;
  /// bilateral: neighbours that differ by at least this much do not count. Positive, in the unit
  /// of heights.
  double edge_height = 0;
  base::StopCheck check_stop = {};
};

struct HeightChange {
  VertexId vertex = kNoVertex;
  double height = 0;
};

/// Returns new heights of the vertices of `region` that may move, in ascending order of slots.
/// Vertices on the hull or with a neighbour outside the region stay, and so does a vertex whose
/// triangles are too thin for their angles to be computed in double.
///
/// A neighbour's weight is the length of the common side of the two Voronoi cells divided by the
/// distance in the plane. `laplacian` and `taubin` therefore preserve planes, however irregular the
/// points. `bilateral` does so where neighbours are placed symmetrically, as on grids. `laplacian`
/// and `bilateral` never leave the range of heights in the region.
///
/// Each iteration reads only the heights of the previous one, so the order of vertices does not
/// matter. Time O(vertices of the region * iterations). Memory: 16 bytes per edge of the region.
///
/// Throws std::invalid_argument for options that are out of range or would make heights grow
/// without bound, for a height in the region that is not finite, and if an array of heights is
/// shorter than vertex_slots().
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
