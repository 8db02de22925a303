// SPDX-License-Identifier: GPL-3.0-or-later
#include "terrace/tri/reconstruct.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "reconstruct/methods.hpp"
#include "shape/surface_parts.hpp"

namespace terrace::tri {
namespace {

using reconstruct::Face;

struct Box {
  Point3 min{}, max{};
};

Box box_of(std::span<const Point3> points) {
  Box box{points[0], points[0]};
  for (const Point3& p : points) {
    for (std::size_t k = 0; k < 3; ++k) {
      box.min[k] = std::min(box.min[k], p[k]);
      box.max[k] = std::max(box.max[k], p[k]);
    }
  }
  return box;
}

void check_option(const char* name, double value, bool ok, const char* range) {
  if (!ok)
    throw std::invalid_argument(std::string(name) + " is " + std::to_string(value) +
                                ", but must be " + range);
}

void check(std::span<const Point3> points, const SurfaceOptions& options) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const double c : points[i])
      if (!std::isfinite(c))
        throw std::invalid_argument("point " + std::to_string(i) +
                                    ": coordinates are not finite; leave such points out");
  }
  const auto finite = [](double value) { return std::isfinite(value); };
  check_option("quantise_bits", options.quantise_bits, options.quantise_bits <= 30, "at most 30");
  if (options.metric) {
    if (options.method != SurfaceMethod::kShape || options.quantise_bits != 0)
      throw std::invalid_argument(
          "a metric is for the method kShape without quantise_bits; leave one of them out");
    check_metric(*options.metric, "the metric of a surface");
  }
  check_option("radius_ratio_bound", options.radius_ratio_bound,
               finite(options.radius_ratio_bound) && options.radius_ratio_bound > 0,
               "positive and finite");
  check_option("beta", options.beta,
               finite(options.beta) && options.beta > 0 && options.beta < 1.5707963267948966,
               "between 0 and pi / 2");
  check_option("alpha", options.alpha, finite(options.alpha) && options.alpha >= 0,
               "at least 0 and finite");
  check_option("offset", options.offset, finite(options.offset) && options.offset >= 0,
               "at least 0 and finite");
}

/// What CGAL's constructions can bear.
void check_range(std::span<const Point3> points, const Box& box) {
  constexpr double kLargest = 1e100, kSmallest = 1e-100;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (const double c : points[i])
      if (std::abs(c) > kLargest)
        throw std::invalid_argument(
            "point " + std::to_string(i) +
            ": a coordinate is beyond 1e100, too large for this method; scale the points");
  double side = 0.0;
  for (std::size_t k = 0; k < 3; ++k) side = std::max(side, box.max[k] - box.min[k]);
  if (side > 0.0 && side < kSmallest)
    throw std::invalid_argument(
        "the points' box is smaller than 1e-100, too small for this method; scale the points");
}

/// Points that are in no face are left out.
ReconstructedSurface compact(std::span<const Point3> points, std::vector<Face> faces) {
  ReconstructedSurface result;
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
  result.surface.faces = std::move(faces);
  return result;
}

template <class Triangulation>
std::vector<Face> shape_faces(std::span<const typename Triangulation::Point> points,
                              const ShapeOptions& options,
                              Triangulation triangulation = Triangulation()) {
  const std::vector<VertexId> vertices = triangulation.build(points);
  std::vector<std::uint32_t> point_of(triangulation.vertex_slots());
  for (std::size_t i = vertices.size(); i-- > 0;)
    point_of[slot(vertices[i])] = static_cast<std::uint32_t>(i);
  BasicShape3<Triangulation> shape(options);
  shape.restore(triangulation);
  ShapeSurface surface = shape.surface(triangulation);
  for (Face& face : surface.surface.faces)
    for (std::uint32_t& v : face) v = point_of[slot(surface.vertices[v])];
  return std::move(surface.surface.faces);
}

std::vector<std::array<std::int32_t, 3>> quantised(std::span<const Point3> points, unsigned bits) {
  std::vector<std::array<std::int32_t, 3>> result(points.size());
  if (points.empty()) return result;
  const Box box = box_of(points);
  // Halves, so that no difference overflows.
  double side = 0.0;
  for (std::size_t k = 0; k < 3; ++k) side = std::max(side, box.max[k] / 2 - box.min[k] / 2);
  if (side == 0.0) return result;
  const auto last = static_cast<double>((std::uint32_t{1} << bits) - 1);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      result[i][k] =
          static_cast<std::int32_t>((points[i][k] / 2 - box.min[k] / 2) / side * last + 0.5);
  return result;
}

std::vector<Face> front_faces(std::span<const Point3> points, const SurfaceOptions& options) {
  // CGAL wants different points that span space.
  Delaunay3<double> triangulation;
  const std::vector<VertexId> vertices = triangulation.build(points);
  if (triangulation.tetrahedron_count() == 0) return {};
  std::vector<bool> met(triangulation.vertex_slots());
  std::vector<Point3> different;
  std::vector<std::uint32_t> point_of;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (met[slot(vertices[i])]) continue;
    met[slot(vertices[i])] = true;
    different.push_back(points[i]);
    point_of.push_back(static_cast<std::uint32_t>(i));
  }
  triangulation.clear();
  std::vector<Face> faces =
      reconstruct::advancing_front(different, options.radius_ratio_bound, options.beta);
  // The order and the first corners that CGAL gives depend on addresses in memory.
  for (Face& face : faces) {
    for (std::uint32_t& v : face) v = point_of[v];
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
  }
  std::sort(faces.begin(), faces.end());
  return faces;
}

/// Components whose volume is negative are turned.
void turn_outward(Surface& surface) {
  SurfaceParts parts = parts_of(surface.faces);
  std::vector<double> volume(surface.faces.size());
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f) {
    const std::uint32_t part = parts.root(f);
    volume[part] += volume6_from(surface, surface.points[surface.faces[part][0]], f);
  }
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f)
    if (volume[parts.root(f)] < 0.0) std::swap(surface.faces[f][1], surface.faces[f][2]);
}

Surface wrapped(std::span<const Point3> points, const Box& box, const SurfaceOptions& options) {
  double alpha = options.alpha;
  if (alpha == 0.0) {
    double diagonal2 = 0.0;
    for (std::size_t k = 0; k < 3; ++k)
      diagonal2 += (box.max[k] - box.min[k]) * (box.max[k] - box.min[k]);
    const double spacing = std::sqrt(1 / static_cast<double>(points.size()));
    alpha = std::sqrt(diagonal2) * std::max(0.05, 4 * spacing);
    if (alpha == 0.0) return {};
  }
  return reconstruct::alpha_wrap(points, alpha,
                                 options.offset == 0.0 ? alpha / 30 : options.offset);
}

}  // namespace

ReconstructedSurface reconstruct_surface(std::span<const Point3> points,
                                         const SurfaceOptions& options) {
  check(points, options);
  if (options.method == SurfaceMethod::kShape) {
    if (options.metric)
      return compact(points,
                     shape_faces(points, options.shape, EllipticalDelaunay3(*options.metric)));
    if (options.quantise_bits == 0)
      return compact(points, shape_faces<Delaunay3<double>>(points, options.shape));
    const auto integers = quantised(points, options.quantise_bits);
    return compact(points, shape_faces<Delaunay3<std::int32_t>>(integers, options.shape));
  }
  if (points.empty()) return {};
  const Box box = box_of(points);
  check_range(points, box);
  if (options.method == SurfaceMethod::kAlphaWrap) return {wrapped(points, box, options), {}};
  ReconstructedSurface result = compact(points, front_faces(points, options));
  turn_outward(result.surface);
  return result;
}

}  // namespace terrace::tri
