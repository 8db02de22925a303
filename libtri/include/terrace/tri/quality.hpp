// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/interpolation.hpp"

/// Quality measures of a triangulation and of the surface on it. Angles, aspects and edges are
/// measured in the plane, where the triangulation is Delaunay. Computed in double. Lengths whose
/// squares overflow give infinities.

namespace terrace::tri {

struct TriangleQuality {
  double min_angle_degrees = 0;  ///< 0 to 60
  /// The longest edge over 2 sqrt(3) times the radius of the inscribed circle: 1 for an equilateral
  /// triangle, larger for all others.
  double aspect = 1;
  std::array<double, 3> edges{};  ///< lengths. Edge i is opposite to corner i
  double area = 0;                ///< in the plane
  double surface_area = 0;        ///< of the sloping triangle, or NaN if a height is NaN
  double volume_above = 0;        ///< below the surface and above the datum; NaN if a height is NaN
  double volume_below = 0;        ///< above the surface and below the datum, >= 0; NaN if a height
                                  ///< is NaN
};

/// Requires a triangle of the triangulation. datum: the height to which volumes refer.
template <class Coord>
TriangleQuality triangle_quality(const Delaunay2<Coord>& triangulation, const Heights& heights,
                                 TriangleId triangle, double datum = 0);

/// All numbers are 0 if there are no triangles.
struct MeshQuality {
  std::size_t triangles = 0;
  double min_angle_degrees = 0;
  double mean_min_angle_degrees = 0;
  double max_aspect = 0;
  double mean_aspect = 0;

  std::size_t edges = 0;  ///< each counted once
  double min_edge = 0;
  double max_edge = 0;
  double mean_edge = 0;
  /// Counts of edges in equal intervals from min_edge to max_edge.
  std::vector<std::size_t> edge_histogram;

  double area = 0;
  double surface_area = 0;
  double volume_above = 0;
  double volume_below = 0;
  /// above - below: the integral of height - datum.
  [[nodiscard]] double volume() const { return volume_above - volume_below; }
};

/// Measures all triangles. O(n). Throws std::invalid_argument if an array of heights is shorter
/// than vertex_slots(), or if the number of bins is 0.
template <class Coord>
MeshQuality mesh_quality(const Delaunay2<Coord>& triangulation, const Heights& heights,
                         double datum = 0, std::size_t histogram_bins = 16);

struct VerticalDistances {
  std::size_t count = 0;  ///< points measured
  /// Points that are not measured because they are outside the hull or a height is NaN.
  std::size_t outside = 0;
  double max = 0;   ///< of the distances' absolute values
  double mean = 0;  ///< of the distances' absolute values
  double rms = 0;
  double bias = 0;        ///< mean of point - surface
  std::size_t worst = 0;  ///< index of the first point at the distance `max`
};

/// Measures how far points that are not in the triangulation are above or below its surface.
/// `threads` and errors are as in heights_at(). The result does not depend on the number of
/// threads.
template <class Coord>
VerticalDistances vertical_distances(const Delaunay2<Coord>& triangulation, const Heights& heights,
                                     std::span<const Point3> points,
                                     Interpolation method = Interpolation::linear,
                                     unsigned threads = 0);

#define TERRACE_TRI_DECLARE(Coord)                                                          \
  extern template TriangleQuality triangle_quality(const Delaunay2<Coord>&, const Heights&, \
                                                   TriangleId, double);                     \
  extern template MeshQuality mesh_quality(const Delaunay2<Coord>&, const Heights&, double, \
                                           std::size_t);                                    \
  extern template VerticalDistances vertical_distances(                                     \
      const Delaunay2<Coord>&, const Heights&, std::span<const Point3>, Interpolation, unsigned);
TERRACE_TRI_DECLARE(std::int32_t)
TERRACE_TRI_DECLARE(double)
#undef TERRACE_TRI_DECLARE

}  // namespace terrace::tri
