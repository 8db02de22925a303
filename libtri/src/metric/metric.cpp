// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/metric.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

#include <terrace/base/portable_math.hpp>

#include "delaunay2/double_kernel.hpp"
#include "delaunay3/double_kernel.hpp"

namespace terrace::tri {
namespace {

void check_semi_axis(double length, const std::string& axis_name) {
  if (length > 0.0 && std::isfinite(length) && std::isfinite(1.0 / length)) return;
  throw std::invalid_argument("semi-axis " + axis_name + " is " + std::to_string(length) +
                              "; it must be positive and finite, in the unit of the points");
}

/// (cosine, sine) of an angle in degrees.
std::array<double, 2> direction_of(double degrees) {
  if (!std::isfinite(degrees)) {
    throw std::invalid_argument(
        "the angle of an ellipse is not finite; give it in degrees, counter-clockwise from +x");
  }
  const auto [s, c] = base::sin_cos_degrees(degrees);
  return {c, s};
}

/// True if the rows of the map are linearly independent. Exact.
bool invertible(const LinearMap2& m) {
  return planar::DoubleKernel::orientation({0, 0}, {m[0], m[1]}, {m[2], m[3]}) != 0;
}
bool invertible(const LinearMap3& m) {
  return spatial::DoubleKernel::orientation({0, 0, 0}, {m[0], m[1], m[2]}, {m[3], m[4], m[5]},
                                            {m[6], m[7], m[8]}) != 0;
}

template <std::size_t Dimension>
std::string listed(const LinearMap<Dimension>& map) {
  std::string text;
  for (std::size_t i = 0; i < map.size(); ++i)
    text += (i == 0 ? "" : i % Dimension == 0 ? "; " : ", ") + std::to_string(map[i]);
  return text;
}

template <std::size_t Dimension>
void check(const LinearMap<Dimension>& map, const std::string& what) {
  for (const double m : map) {
    if (std::isfinite(m)) continue;
    throw std::invalid_argument(what + " has an entry that is not finite; give a finite matrix");
  }
  if (invertible(map)) return;
  throw std::invalid_argument(what + " is not invertible (" + listed<Dimension>(map) +
                              "), so it maps different points to one; give the map of an " +
                              (Dimension == 2 ? "ellipse" : "ellipsoid"));
}

}  // namespace

void check_metric(const LinearMap2& map, const std::string& what) { check<2>(map, what); }
void check_metric(const LinearMap3& map, const std::string& what) { check<3>(map, what); }

LinearMap2 ellipse_map(double a, double b, double angle_degrees) {
  return ellipse_map(a, b, direction_of(angle_degrees));
}

LinearMap2 ellipse_map(double a, double b, const std::array<double, 2>& direction) {
  check_semi_axis(a, "a of an ellipse");
  check_semi_axis(b, "b of an ellipse");
  const auto& [c, s] = direction;
  if (!(std::abs(c * c + s * s - 1.0) <= 1e-9)) {
    throw std::invalid_argument("the direction of an ellipse, " + std::to_string(c) + ", " +
                                std::to_string(s) + ", is not a unit vector");
  }
  // The sum over the axes of e e^T / semi-axis.
  const double off_diagonal = c * s / a - s * c / b;
  const LinearMap2 map{c * c / a + s * s / b, off_diagonal, off_diagonal, s * s / a + c * c / b};
  check_metric(map, "the rounded map of an ellipse");
  return map;
}

LinearMap2 plane_map(const LinearMap3& m) {
  if (m[2] == 0.0 && m[5] == 0.0 && m[6] == 0.0 && m[7] == 0.0) {
    const LinearMap2 map{m[0], m[1], m[3], m[4]};
    check_metric(map, "the map of space, restricted to the plane,");
    return map;
  }
  // Gram-Schmidt on the images of both axes.
  const double first = base::hypot(base::hypot(m[0], m[3]), m[6]);
  const double shear = (m[0] / first) * m[1] + (m[3] / first) * m[4] + (m[6] / first) * m[7];
  const double height =
      base::hypot(base::hypot(m[1] - shear * (m[0] / first), m[4] - shear * (m[3] / first)),
                  m[7] - shear * (m[6] / first));
  const LinearMap2 map{first, shear, 0.0, height};
  check_metric(map, "the map of space, restricted to the plane,");
  return map;
}

LinearMap3 ellipsoid_map(const std::array<double, 3>& semi_axes, const LinearMap3& axes) {
  for (std::size_t i = 0; i < 3; ++i)
    check_semi_axis(semi_axes[i], std::to_string(i) + " of an ellipsoid");
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = i; j < 3; ++j) {
      const double product = axes[3 * i] * axes[3 * j] + axes[3 * i + 1] * axes[3 * j + 1] +
                             axes[3 * i + 2] * axes[3 * j + 2];
      if (std::abs(product - (i == j ? 1.0 : 0.0)) <= 1e-9) continue;
      throw std::invalid_argument("the axes of an ellipsoid, " + listed<3>(axes) +
                                  ", are not orthonormal rows (rows " + std::to_string(i) +
                                  " and " + std::to_string(j) + ")");
    }
  }
  // The sum over the axes of e e^T / semi-axis.
  LinearMap3 map{};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = r; c < 3; ++c) {
      double sum = 0.0;
      for (std::size_t i = 0; i < 3; ++i) sum += axes[3 * i + r] * axes[3 * i + c] / semi_axes[i];
      map[3 * r + c] = map[3 * c + r] = sum;
    }
  }
  check_metric(map, "the rounded map of an ellipsoid");
  return map;
}

double metric_length(const LinearMap3& m, const std::array<double, 3>& v) {
  const auto row = [&](std::size_t r) { return m[r] * v[0] + m[r + 1] * v[1] + m[r + 2] * v[2]; };
  const double x = row(0), y = row(3), z = row(6);
  return std::sqrt(x * x + y * y + z * z);
}

template <std::size_t Dimension>
EllipticalMetric<Dimension>::EllipticalMetric(const Map& map) : map_(map) {
  check_metric(map, "the map of an elliptical metric");
}

template <std::size_t Dimension>
MetricField<Dimension>::MetricField(std::vector<Region> regions) {
  for (std::size_t r = 0; r < regions.size(); ++r) {
    for (std::size_t axis = 0; axis < Dimension; ++axis) {
      if (regions[r].box.min[axis] <= regions[r].box.max[axis]) continue;
      throw std::invalid_argument("region " + std::to_string(r) +
                                  " of a field of metrics is empty or NaN along axis " +
                                  std::to_string(axis) + "; give min <= max");
    }
    check_metric(regions[r].map, "the map of region " + std::to_string(r));
  }
  map_at_ = [list = std::move(regions)](const Point& p) {
    for (const Region& region : list) {
      bool inside = true;
      for (std::size_t axis = 0; axis < Dimension; ++axis)
        inside = inside && region.box.min[axis] <= p[axis] && p[axis] <= region.box.max[axis];
      if (inside) return region.map;
    }
    return kIdentityMap<Dimension>;
  };
}

template <std::size_t Dimension>
MetricField<Dimension>::MetricField(std::function<Map(const Point&)> map_at)
    : map_at_(std::move(map_at)) {
  if (!map_at_) throw std::invalid_argument("a field of metrics has no function; give one");
}

template class EllipticalMetric<2>;
template class EllipticalMetric<3>;
template class MetricField<2>;
template class MetricField<3>;

}  // namespace terrace::tri
