// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/quality.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <terrace/base/portable_math.hpp>

#include "check_input.hpp"

namespace terrace::tri {
namespace {

using Vector = std::array<double, 2>;

double length(const Vector& v) { return base::hypot(v[0], v[1]); }

/// The volume above zero under a triangle with these heights, divided by its area.
double mean_above(std::array<double, 3> h) {
  if (std::isnan(h[0] + h[1] + h[2])) return std::numeric_limits<double>::quiet_NaN();
  std::sort(h.begin(), h.end());
  const auto& [low, middle, high] = h;
  // The tip that is cut off is a pyramid over a similar triangle.
  const auto tip = [](double apex, double b, double c) {
    return apex * (apex / (apex - b)) * (apex / (apex - c)) / 3;
  };
  if (high <= 0) return 0;
  if (low >= 0) return (low + middle + high) / 3;
  if (middle <= 0) return tip(high, middle, low);
  return (low + middle + high) / 3 + tip(-low, -middle, -high);
}

}  // namespace

template <class Coord>
TriangleQuality triangle_quality(const Delaunay2<Coord>& triangulation, const Heights& heights,
                                 TriangleId triangle, double datum) {
  const auto vertices = triangulation.vertices(triangle);
  std::array<Vector, 3> at;
  std::array<double, 3> height;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto p = triangulation.point(vertices[i]);
    at[i] = {static_cast<double>(p[0]), static_cast<double>(p[1])};
    height[i] = heights(vertices[i]) - datum;
  }
  // Edges opposite to corner i, counter-clockwise. All are scaled by a power of two to lengths of
  // about 1, so that only results that are sizes themselves can overflow.
  std::array<Vector, 3> edge;
  int exponent = 0;
  const auto compute_edges = [&](double unit) {
    double largest = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 2; ++k) {
        edge[i][k] = at[(i + 2) % 3][k] * unit - at[(i + 1) % 3][k] * unit;
        largest = std::max(largest, std::abs(edge[i][k]));
      }
    }
    exponent = std::ilogb(largest);
    return std::isfinite(largest);
  };
  int quarters = 0;
  if (!compute_edges(1)) {  // differences of finite doubles may overflow
    compute_edges(0.25);
    quarters = 2;
  }
  TriangleQuality result;
  std::array<double, 3> lengths;
  for (std::size_t i = 0; i < 3; ++i) {
    for (double& c : edge[i]) c = std::scalbn(c, -exponent);
    lengths[i] = length(edge[i]);
  }
  exponent += quarters;
  for (std::size_t i = 0; i < 3; ++i) result.edges[i] = std::scalbn(lengths[i], exponent);
  const auto cross = [](const Vector& a, const Vector& b) { return a[0] * b[1] - a[1] * b[0]; };
  const auto dot = [](const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1]; };
  // The smallest angle is opposite to the shortest edge.
  const auto least =
      static_cast<std::size_t>(std::min_element(lengths.begin(), lengths.end()) - lengths.begin());
  const Vector& a = edge[(least + 1) % 3];
  const Vector& b = edge[(least + 2) % 3];
  const double twice_area = std::max(0.0, cross(a, b));
  result.min_angle_degrees = base::atan2_degrees(twice_area, -dot(a, b));
  result.area = std::scalbn(twice_area, 2 * exponent - 1);
  result.aspect = *std::max_element(lengths.begin(), lengths.end()) *
                  (lengths[0] + lengths[1] + lengths[2]) / (2 * std::numbers::sqrt3 * twice_area);
  // These are the components of the normal of the sloping triangle besides twice_area.
  const double bh = std::scalbn(height[1] - height[0], -exponent);
  const double ch = std::scalbn(height[2] - height[0], -exponent);
  const double x = bh * -edge[1][1] - ch * edge[2][1];
  const double y = ch * edge[2][0] - bh * -edge[1][0];
  result.surface_area = std::scalbn(base::hypot(base::hypot(twice_area, x), y), 2 * exponent - 1);
  result.volume_above = result.area * mean_above(height);
  result.volume_below = result.area * mean_above({-height[0], -height[1], -height[2]});
  return result;
}

template <class Coord>
MeshQuality mesh_quality(const Delaunay2<Coord>& triangulation, const Heights& heights,
                         double datum, std::size_t histogram_bins) {
  check_heights(triangulation, heights);
  if (histogram_bins == 0)
    throw std::invalid_argument("quality: a histogram needs at least one bin");
  MeshQuality sum;
  sum.edge_histogram.assign(histogram_bins, 0);
  std::vector<double> edges;
  for (const TriangleId t : triangulation.all_triangles()) {
    const TriangleQuality q = triangle_quality(triangulation, heights, t, datum);
    sum.min_angle_degrees = sum.triangles == 0
                                ? q.min_angle_degrees
                                : std::min(sum.min_angle_degrees, q.min_angle_degrees);
    ++sum.triangles;
    sum.mean_min_angle_degrees += q.min_angle_degrees;
    sum.max_aspect = std::max(sum.max_aspect, q.aspect);
    sum.mean_aspect += q.aspect;
    sum.area += q.area;
    sum.surface_area += q.surface_area;
    sum.volume_above += q.volume_above;
    sum.volume_below += q.volume_below;
    const auto neighbours = triangulation.neighbours(t);
    for (std::size_t i = 0; i < 3; ++i)
      if (neighbours[i] == kNoTriangle || t < neighbours[i]) edges.push_back(q.edges[i]);
  }
  if (sum.triangles == 0) return sum;
  sum.mean_min_angle_degrees /= static_cast<double>(sum.triangles);
  sum.mean_aspect /= static_cast<double>(sum.triangles);
  sum.edges = edges.size();
  const auto [shortest, longest] = std::minmax_element(edges.begin(), edges.end());
  sum.min_edge = *shortest;
  sum.max_edge = *longest;
  const double width = (sum.max_edge - sum.min_edge) / static_cast<double>(histogram_bins);
  for (const double edge : edges) {
    sum.mean_edge += edge;
    const double bin = width > 0 ? (edge - sum.min_edge) / width : 0;
    const bool last = !(bin < static_cast<double>(histogram_bins));
    ++sum.edge_histogram[last ? histogram_bins - 1 : static_cast<std::size_t>(bin)];
  }
  sum.mean_edge /= static_cast<double>(edges.size());
  return sum;
}

template <class Coord>
VerticalDistances vertical_distances(const Delaunay2<Coord>& triangulation, const Heights& heights,
                                     std::span<const Point3> points, Interpolation method,
                                     unsigned threads) {
  std::vector<Point2> queries;
  queries.reserve(points.size());
  for (const Point3& p : points) queries.push_back({p[0], p[1]});
  const std::vector<double> surface = heights_at(triangulation, heights, queries, method, threads);
  VerticalDistances result;
  double squares = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double difference = points[i][2] - surface[i];
    if (std::isnan(difference)) {
      ++result.outside;
      continue;
    }
    const double distance = std::abs(difference);
    if (result.count == 0 || distance > result.max) {
      result.max = distance;
      result.worst = i;
    }
    ++result.count;
    result.mean += distance;
    result.bias += difference;
    squares += distance * distance;
  }
  if (result.count == 0) return result;
  const auto count = static_cast<double>(result.count);
  result.mean /= count;
  result.bias /= count;
  result.rms = std::sqrt(squares / count);
  return result;
}

#define TERRACE_TRI_DEFINE(Coord)                                                                  \
  template TriangleQuality triangle_quality(const Delaunay2<Coord>&, const Heights&, TriangleId,   \
                                            double);                                               \
  template MeshQuality mesh_quality(const Delaunay2<Coord>&, const Heights&, double, std::size_t); \
  template VerticalDistances vertical_distances(const Delaunay2<Coord>&, const Heights&,           \
                                                std::span<const Point3>, Interpolation, unsigned);
TERRACE_TRI_DEFINE(std::int32_t)
TERRACE_TRI_DEFINE(double)
#undef TERRACE_TRI_DEFINE

}  // namespace terrace::tri
