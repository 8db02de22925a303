// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "terrace/tri/shape.hpp"

namespace terrace::tri {
namespace {

using Face = std::array<std::uint32_t, 3>;

void check(std::span<const Point3> points, const RestoreOptions& options) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const double c : points[i])
      if (!std::isfinite(c))
        throw std::invalid_argument("point " + std::to_string(i) +
                                    ": coordinates are not finite; leave such points out");
  }
  if (options.quantise_bits > 30)
    throw std::invalid_argument("quantise_bits is " + std::to_string(options.quantise_bits) +
                                ", but must be at most 30");
  if (options.metric && options.quantise_bits != 0)
    throw std::invalid_argument("a metric and quantise_bits are given; leave one of them out");
}

/// Drops points that are not in any face of the result, whose faces refer to input points.
RestoredSurface compact(std::span<const Point3> points, RestoredSurface result) {
  std::vector<Face>& faces = result.surface.faces;
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(points.size(), kUnused);
  for (const Face& face : faces)
    for (const std::uint32_t v : face) number[v] = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (number[i] == kUnused) continue;
    number[i] = static_cast<std::uint32_t>(result.input.size());
    result.input.push_back(i);
    result.surface.points.push_back(points[i]);
  }
  for (Face& face : faces)
    for (std::uint32_t& v : face) v = number[v];
  return result;
}

/// Restores a surface without its points. Faces refer to those of the input.
template <class Triangulation>
RestoredSurface shape_faces(std::span<const typename Triangulation::Point> points,
                            const RestoreOptions& options,
                            Triangulation triangulation = Triangulation()) {
  triangulation.set_check_stop(options.check_stop);
  const std::vector<VertexId> vertices =
      triangulation.build(points, options.threads == 0 ? 2 : options.threads);
  std::vector<std::uint32_t> point_of(triangulation.vertex_slots());
  for (std::size_t i = vertices.size(); i-- > 0;)
    point_of[slot(vertices[i])] = static_cast<std::uint32_t>(i);
  BasicShape3<Triangulation> shape(options.shape);
  shape.restore(triangulation, options.threads, options.check_stop);
  ShapeSurface surface = options.shape.rule == ShapeRule::poles
                             ? shape.surface_without_lids(triangulation)
                             : shape.surface(triangulation);
  if (options.check_stop) options.check_stop();
  RestoredSurface result;
  result.parts = shape.parts(triangulation, surface);
  result.surface.faces = std::move(surface.surface.faces);
  for (Face& face : result.surface.faces)
    for (std::uint32_t& v : face) v = point_of[slot(surface.vertices[v])];
  result.unused_points = triangulation.vertex_count() - surface.vertices.size();
  result.open = surface.open;
  result.lids = surface.lids;
  return result;
}

std::vector<std::array<std::int32_t, 3>> quantise(std::span<const Point3> points, unsigned bits) {
  std::vector<std::array<std::int32_t, 3>> result(points.size());
  if (points.empty()) return result;
  Point3 min = points[0], max = points[0];
  for (const Point3& p : points) {
    for (std::size_t k = 0; k < 3; ++k) {
      min[k] = std::min(min[k], p[k]);
      max[k] = std::max(max[k], p[k]);
    }
  }
  // Uses halves, so that differences do not overflow.
  double side = 0.0;
  for (std::size_t k = 0; k < 3; ++k) side = std::max(side, max[k] / 2 - min[k] / 2);
  if (side == 0.0) return result;
  const auto last = static_cast<double>((std::uint32_t{1} << bits) - 1);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      result[i][k] = static_cast<std::int32_t>((points[i][k] / 2 - min[k] / 2) / side * last + 0.5);
  return result;
}

}  // namespace

RestoredSurface restore_surface(std::span<const Point3> points, const RestoreOptions& options) {
  check(points, options);
  if (options.metric)
    return compact(points, shape_faces(points, options,
                                       Delaunay3<double, EllipticalMetric3>(*options.metric)));
  if (options.quantise_bits == 0)
    return compact(points, shape_faces<Delaunay3<double>>(points, options));
  const auto integers = quantise(points, options.quantise_bits);
  return compact(points, shape_faces<Delaunay3<std::int32_t>>(integers, options));
}

}  // namespace terrace::tri
