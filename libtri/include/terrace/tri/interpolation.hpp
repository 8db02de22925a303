// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "terrace/tri/delaunay2.hpp"

/// Heights, slopes and aspects at any position on a triangulation. x grows to the east and y to the
/// north.

namespace terrace::tri {

using Point2 = std::array<double, 2>;

/// Anything with a member function height(VertexId), such as MultiresolutionModel.
template <class T>
concept HasHeights = requires(const T& t, VertexId vertex) {
  { t.height(vertex) } -> std::convertible_to<double>;
};

/// A function that returns the height of a vertex.
template <class T>
concept HeightFunction = std::is_invocable_r_v<double, const T&, VertexId>;

/// The heights of vertices: an array indexed by slot(vertex), a function, or an object with a
/// member function height(VertexId). It refers to its argument as std::span does, so use it for
/// parameters only. With several threads the function is called concurrently.
class Heights {
 public:
  template <class T>
  requires std::convertible_to<const T&, std::span<const double>> Heights(const T& by_slot)
      : values_(std::span<const double>(by_slot).data()),
        slots_(std::span<const double>(by_slot).size()) {}
  template <class T>
  requires(HeightFunction<T> && !std::is_same_v<T, Heights>) Heights(const T& function)
      : object_(std::addressof(function)), call_([](const void* object, VertexId vertex) {
          return static_cast<double>((*static_cast<const T*>(object))(vertex));
        }) {}
  template <HasHeights T>
  Heights(const T& model)
      : object_(std::addressof(model)), call_([](const void* object, VertexId vertex) {
          return static_cast<double>(static_cast<const T*>(object)->height(vertex));
        }) {}

  /// Requires slot(vertex) < slots().
  double operator()(VertexId vertex) const {
    return call_ == nullptr ? values_[slot(vertex)] : call_(object_, vertex);
  }
  /// The length of the array, unlimited for functions.
  [[nodiscard]] std::size_t slots() const { return slots_; }

 private:
  const double* values_ = nullptr;
  const void* object_ = nullptr;
  double (*call_)(const void*, VertexId) = nullptr;
  std::size_t slots_ = std::numeric_limits<std::size_t>::max();
};

enum class Interpolation : std::uint8_t {
  /// The nearest vertex, also outside the hull. Of equally near vertices it is the
  /// lexicographically smallest.
  nearest,
  /// Barycentric coordinates in the triangle.
  linear,
  /// The areas that the query's Voronoi cell would take from the cells of its neighbours (R.
  /// Sibson, "A vector identity for the Dirichlet tessellation", doi:10.1017/S0305004100056589).
  /// Continuous, smooth except at vertices, and independent of how cocircular points are
  /// triangulated.
  natural_neighbour,
};

struct VertexWeight {
  VertexId vertex = kNoVertex;
  double weight = 0;
};

/// Computes the weights of the vertices that interpolate at a query. They are >= 0, their sum is 1,
/// and (except with `nearest`) the weighted mean of the vertices is the query. There are none
/// outside the hull (`linear`, `natural_neighbour`) and in an empty triangulation. The hull counts
/// as inside, decided exactly. If all points are collinear, the hull is the segment between the
/// outermost ones. On a vertex only that vertex has a weight. On a hull edge only its two ends have
/// one.
///
/// The triangles that a query affects are found exactly. Weights are computed in double. If the
/// estimated error is above 1e-11 (needles, queries close to the hull, coordinates near the ends of
/// the range) they are recomputed with rational numbers, about a hundred times as slow. With more
/// than 32 neighbours these numbers are limited to 512 bits, so that the time grows only with the
/// number of neighbours.
///
/// Replaces the contents of `weights`. hint: a vertex near the query, where the walk starts. Throws
/// std::invalid_argument for a query that is not finite.
template <class Coord>
void weights_at(const Delaunay2<Coord>& triangulation, const Point2& query, Interpolation method,
                std::vector<VertexWeight>& weights, VertexId hint = kNoVertex);

/// Returns the heights at many queries, in their order. A height is NaN if there are no weights or
/// if a vertex with a weight has the height NaN. Queries are sorted along a Hilbert curve
/// internally, so pass many at once: they take about 0.4 us each on one core. threads: 0 for one
/// per core. The result does not depend on it. Memory: 16 bytes per query, for at most 2^24 queries
/// at a time.
///
/// Throws std::invalid_argument, naming the index, for a query that is not finite, and if an array
/// of heights is shorter than vertex_slots().
template <class Coord>
std::vector<double> heights_at(const Delaunay2<Coord>& triangulation, const Heights& heights,
                               std::span<const Point2> queries, Interpolation method,
                               unsigned threads = 0);

/// Change in height per unit of length to the east and to the north, NaN if undefined.
struct Gradient {
  double x = std::numeric_limits<double>::quiet_NaN();
  double y = std::numeric_limits<double>::quiet_NaN();
};

enum class GradientFrom : std::uint8_t {
  /// The gradient of the triangle. On edges and vertices, the area-weighted mean over the triangles
  /// that meet there.
  triangles,
  /// The derivative of natural neighbour interpolation. On a vertex, where the derivative does not
  /// exist, the mean over the vertex's Voronoi cell by the same formula, which is exact for planes.
  /// On hull edges and hull vertices, whose cells are unbounded, the gradient of `triangles`.
  natural_neighbours,
};

/// Returns the gradients at many queries. Otherwise like heights_at(). Gradients are undefined
/// outside the hull, and everywhere if all points are collinear.
template <class Coord>
std::vector<Gradient> gradients_at(const Delaunay2<Coord>& triangulation, const Heights& heights,
                                   std::span<const Point2> queries, GradientFrom from,
                                   unsigned threads = 0);

/// The angle between the surface and the horizontal in degrees, 0 to 90. Heights and coordinates
/// must have the same unit.
[[nodiscard]] double slope_degrees(const Gradient& gradient);

/// The direction of steepest descent in degrees clockwise from north (+y), so east (+x) is 90. 0 <=
/// aspect < 360, or NaN if the surface is level.
[[nodiscard]] double aspect_degrees(const Gradient& gradient);

#define TERRACE_TRI_DECLARE(Coord)                                                                \
  extern template void weights_at(const Delaunay2<Coord>&, const Point2&, Interpolation,          \
                                  std::vector<VertexWeight>&, VertexId);                          \
  extern template std::vector<double> heights_at(                                                 \
      const Delaunay2<Coord>&, const Heights&, std::span<const Point2>, Interpolation, unsigned); \
  extern template std::vector<Gradient> gradients_at(                                             \
      const Delaunay2<Coord>&, const Heights&, std::span<const Point2>, GradientFrom, unsigned);
TERRACE_TRI_DECLARE(std::int32_t)
TERRACE_TRI_DECLARE(double)
#undef TERRACE_TRI_DECLARE

}  // namespace terrace::tri
