// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <stdexcept>
#include <utility>

#include "delaunay2/double_kernel.hpp"
#include "portable_math.hpp"
#include "terrace/tri/elliptical.hpp"

namespace terrace::tri {
namespace {

void check_semi_axis(double length, const char* name) {
  if (length > 0.0 && std::isfinite(length) && std::isfinite(1.0 / length)) return;
  throw std::invalid_argument(std::string("semi-axis ") + name + " of an ellipse is " +
                              std::to_string(length) +
                              ": it must be positive and finite, in the unit of the points");
}

/// (cosine, sine) of an angle in degrees.
std::array<double, 2> direction_of(double degrees) {
  if (!std::isfinite(degrees)) {
    throw std::invalid_argument(
        "the angle of an ellipse is not finite: give it in degrees, counter-clockwise from +x");
  }
  const auto [s, c] = portable::sine_cosine(degrees);
  return {c, s};
}

/// Whether the rows of the map are not parallel; exact.
bool invertible(const LinearMap2& m) {
  return planar::DoubleKernel::orientation({0, 0}, {m[0], m[1]}, {m[2], m[3]}) != 0;
}

}  // namespace

void check_metric(const LinearMap2& map, const std::string& what) {
  for (const double m : map) {
    if (std::isfinite(m)) continue;
    throw std::invalid_argument(what + " has an entry that is not finite; give a finite matrix");
  }
  if (invertible(map)) return;
  throw std::invalid_argument(what + " has no inverse (" + std::to_string(map[0]) + ", " +
                              std::to_string(map[1]) + "; " + std::to_string(map[2]) + ", " +
                              std::to_string(map[3]) +
                              "), so it maps different points to one; give the map of an ellipse");
}

LinearMap2 ellipse_map(double a, double b, double angle_degrees) {
  return ellipse_map(a, b, direction_of(angle_degrees));
}

LinearMap2 ellipse_map(double a, double b, const std::array<double, 2>& direction) {
  check_semi_axis(a, "a");
  check_semi_axis(b, "b");
  const auto& [c, s] = direction;
  if (!(std::abs(c * c + s * s - 1.0) <= 1e-9)) {
    throw std::invalid_argument("the direction of an ellipse, " + std::to_string(c) + ", " +
                                std::to_string(s) + ", is no unit vector");
  }
  // The sum over the axes of e e^T / semi-axis.
  const double off = c * s / a - s * c / b;
  const LinearMap2 map{c * c / a + s * s / b, off, off, s * s / a + c * c / b};
  check_metric(map, "the rounded map of an ellipse");
  return map;
}

LinearMap2 plane_map(const std::array<double, 9>& m) {
  if (m[2] == 0.0 && m[5] == 0.0 && m[6] == 0.0 && m[7] == 0.0) {
    const LinearMap2 map{m[0], m[1], m[3], m[4]};
    check_metric(map, "the map of space, restricted to the plane,");
    return map;
  }
  // Gram-Schmidt on the images of both axes.
  const double first = portable::length(portable::length(m[0], m[3]), m[6]);
  const double along = (m[0] / first) * m[1] + (m[3] / first) * m[4] + (m[6] / first) * m[7];
  const double across = portable::length(
      portable::length(m[1] - along * (m[0] / first), m[4] - along * (m[3] / first)),
      m[7] - along * (m[6] / first));
  const LinearMap2 map{first, along, 0.0, across};
  check_metric(map, "the map of space, restricted to the plane,");
  return map;
}

MetricField2::MetricField2(std::vector<Region> regions) {
  for (std::size_t r = 0; r < regions.size(); ++r) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      if (regions[r].box.min[axis] <= regions[r].box.max[axis]) continue;
      throw std::invalid_argument("region " + std::to_string(r) +
                                  " of a field of metrics is empty or not a number along axis " +
                                  std::to_string(axis) + "; give min <= max");
    }
    check_metric(regions[r].map, "the map of region " + std::to_string(r));
  }
  map_at_ = [list = std::move(regions)](const Point& p) {
    for (const Region& region : list) {
      const Box3& box = region.box;
      if (box.min[0] <= p[0] && p[0] <= box.max[0] && box.min[1] <= p[1] && p[1] <= box.max[1])
        return region.map;
    }
    return kIdentityMap2;
  };
}

MetricField2::MetricField2(std::function<LinearMap2(const Point&)> map_at)
    : map_at_(std::move(map_at)) {
  if (!map_at_) throw std::invalid_argument("a field of metrics has no function; give one");
}

}  // namespace terrace::tri
