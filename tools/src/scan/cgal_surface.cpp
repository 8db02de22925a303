// SPDX-License-Identifier: GPL-3.0-or-later
#include "scan/cgal_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <terrace/base/stop_check.hpp>
#include <terrace/tri/delaunay3.hpp>

namespace terrace::tools {
namespace {

using Sides = std::array<double, 3>;

/// Returns the side lengths of the points' bounding box. Throws for coordinates that CGAL's
/// constructions cannot handle.
Sides checked_box(std::span<const tri::Point3> points) {
  constexpr double kLargest = 1e100, kSmallest = 1e-100;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const double c : points[i]) {
      // `!(x <= limit)` also rejects NaN.
      if (!(std::abs(c) <= kLargest)) {
        throw std::invalid_argument(
            fmt::format("point {}: a coordinate is not finite or beyond 1e100, too large for this "
                        "method; scale the points",
                        i));
      }
    }
  }
  Sides sides{};
  for (std::size_t k = 0; k < 3; ++k) {
    double min = points[0][k], max = points[0][k];
    for (const tri::Point3& p : points) {
      min = std::min(min, p[k]);
      max = std::max(max, p[k]);
    }
    sides[k] = max - min;
  }
  const double longest = *std::max_element(sides.begin(), sides.end());
  if (longest > 0.0 && longest < kSmallest) {
    throw std::invalid_argument(
        "the points' bounding box is smaller than 1e-100, too small for this method; scale the "
        "points");
  }
  return sides;
}

}  // namespace

tri::RestoredSurface advancing_front_surface(std::span<const tri::Point3> points,
                                             const base::StopCheck& check_stop) {
  if (points.empty()) return {};
  checked_box(points);
  // CGAL requires distinct points that span space.
  tri::Delaunay3<double> triangulation;
  triangulation.set_check_stop(check_stop);
  const std::vector<tri::VertexId> vertices = triangulation.build(points);
  if (triangulation.tetrahedron_count() == 0) return {};
  std::vector<bool> seen(triangulation.vertex_slots());
  std::vector<tri::Point3> distinct;
  std::vector<std::uint32_t> point_of;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (seen[tri::slot(vertices[i])]) continue;
    seen[tri::slot(vertices[i])] = true;
    distinct.push_back(points[i]);
    point_of.push_back(static_cast<std::uint32_t>(i));
  }
  triangulation.clear();

  tri::RestoredSurface result;
  result.surface.faces = advancing_front(distinct, check_stop);
  // Normalise the order of faces and corners, which in CGAL depends on memory addresses.
  for (auto& face : result.surface.faces) {
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
  }
  std::sort(result.surface.faces.begin(), result.surface.faces.end());

  // Leave out points that are in no face.
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(distinct.size(), kUnused);
  for (const auto& face : result.surface.faces) {
    for (const std::uint32_t v : face) number[v] = 0;
  }
  for (std::size_t i = 0; i < distinct.size(); ++i) {
    if (number[i] == kUnused) continue;
    number[i] = static_cast<std::uint32_t>(result.input.size());
    result.input.push_back(point_of[i]);
    result.surface.points.push_back(distinct[i]);
  }
  for (auto& face : result.surface.faces) {
    for (std::uint32_t& v : face) v = number[v];
  }
  tri::turn_outward(result.surface);
  return result;
}

tri::Surface alpha_wrap_surface(std::span<const tri::Point3> points, double alpha) {
  if (points.empty()) return {};
  const Sides sides = checked_box(points);
  if (alpha == 0.0) {
    double diagonal2 = 0.0;
    for (const double side : sides) diagonal2 += side * side;
    const double spacing = std::sqrt(1 / static_cast<double>(points.size()));
    alpha = std::sqrt(diagonal2) * std::max(0.05, 4 * spacing);
    if (alpha == 0.0) return {};
  }
  return alpha_wrap(points, alpha, alpha / 30);
}

}  // namespace terrace::tools
