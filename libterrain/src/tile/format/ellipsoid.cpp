// SPDX-License-Identifier: Apache-2.0
#include "tile/format/ellipsoid.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <terrace/base/portable_math.hpp>

#include "base/vector.hpp"

namespace terrace::terrain {
namespace {

/// Returns the coordinates in units of the ellipsoid's radii.
stream::Point3 in_radii(const stream::Point3& p) {
  return {p[0] / kEquatorialRadius, p[1] / kEquatorialRadius, p[2] / kPolarRadius};
}

/// Distance, in radii, of a point that is practically never hidden.
constexpr double kNeverHidden = 1e6;

/// Returns the distance along `direction`, in radii, of the horizon occlusion point for one point.
double occlusion_distance(const stream::Point3& direction, const stream::Point3& point) {
  const stream::Point3 p = in_radii(point);
  const double square = dot(p, p);
  // A point below the ellipsoid counts as on it.
  const double length = std::sqrt(std::max(1.0, square));
  const double cos_alpha = std::min(1.0, dot(direction, p) / std::sqrt(square));
  const double sin_alpha = std::sqrt(std::max(0.0, 1.0 - cos_alpha * cos_alpha));
  const double cos_beta = 1.0 / length;
  const double sin_beta = std::sqrt(std::max(0.0, length * length - 1.0)) / length;
  const double denominator = cos_alpha * cos_beta - sin_alpha * sin_beta;
  return denominator > 1.0 / kNeverHidden ? 1.0 / denominator : kNeverHidden;
}

}  // namespace

stream::Point3 geocentric(double longitude, double latitude, double height) {
  constexpr double kAxisRatioSquared =
      (kPolarRadius * kPolarRadius) / (kEquatorialRadius * kEquatorialRadius);
  const double sine = base::sin_degrees(latitude), cosine = base::cos_degrees(latitude);
  const double prime_vertical_radius =
      kEquatorialRadius / std::sqrt(1.0 - (1.0 - kAxisRatioSquared) * sine * sine);
  const double from_axis = (prime_vertical_radius + height) * cosine;
  return {from_axis * base::cos_degrees(longitude), from_axis * base::sin_degrees(longitude),
          (kAxisRatioSquared * prime_vertical_radius + height) * sine};
}

LocalFrame local_frame(double longitude, double latitude) {
  const double sin_lon = base::sin_degrees(longitude), cos_lon = base::cos_degrees(longitude);
  const double sin_lat = base::sin_degrees(latitude), cos_lat = base::cos_degrees(latitude);
  return {.east = {-sin_lon, cos_lon, 0.0},
          .north = {-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat},
          .up = {cos_lat * cos_lon, cos_lat * sin_lon, sin_lat}};
}

Sphere bounding_sphere(std::span<const stream::Point3> points) {
  assert(!points.empty());
  stream::Box3 box;
  for (const stream::Point3& p : points) box.include(p);
  Sphere sphere;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sphere.centre[axis] = box.min[axis] + (box.max[axis] - box.min[axis]) / 2.0;
  }
  double square = 0.0;
  for (const stream::Point3& p : points) {
    const stream::Point3 d{p[0] - sphere.centre[0], p[1] - sphere.centre[1],
                           p[2] - sphere.centre[2]};
    square = std::max(square, dot(d, d));
  }
  // The root may have been rounded down.
  sphere.radius = std::sqrt(square) * (1.0 + 1e-12);
  return sphere;
}

stream::Point3 horizon_occlusion_point(const stream::Point3& towards,
                                       std::span<const stream::Point3> points) {
  const stream::Point3 direction = unit(in_radii(towards));
  double farthest = 1.0;
  for (const stream::Point3& p : points)
    farthest = std::max(farthest, occlusion_distance(direction, p));
  return {direction[0] * farthest, direction[1] * farthest, direction[2] * farthest};
}

}  // namespace terrace::terrain
