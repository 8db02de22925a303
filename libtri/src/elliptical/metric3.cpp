// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <stdexcept>
#include <utility>

#include "delaunay3/double_kernel.hpp"
#include "terrace/tri/elliptical.hpp"

namespace terrace::tri {
namespace {

/// Whether the rows of the map do not lie in a plane; exact.
bool invertible(const LinearMap3& m) {
  return spatial::DoubleKernel::orientation({0, 0, 0}, {m[0], m[1], m[2]}, {m[3], m[4], m[5]},
                                            {m[6], m[7], m[8]}) != 0;
}

std::string listed(const LinearMap3& map) {
  std::string text;
  for (std::size_t i = 0; i < 9; ++i)
    text += (i == 0 ? "" : i % 3 == 0 ? "; " : ", ") + std::to_string(map[i]);
  return text;
}

}  // namespace

void check_metric(const LinearMap3& map, const std::string& what) {
  for (const double m : map) {
    if (std::isfinite(m)) continue;
    throw std::invalid_argument(what + " has an entry that is not finite; give a finite matrix");
  }
  if (invertible(map)) return;
  throw std::invalid_argument(what + " has no inverse (" + listed(map) +
                              "), so it maps different points to one; give the map of an "
                              "ellipsoid");
}

LinearMap3 ellipsoid_map(const std::array<double, 3>& semi_axes, const LinearMap3& axes) {
  for (std::size_t i = 0; i < 3; ++i) {
    const double length = semi_axes[i];
    if (length > 0.0 && std::isfinite(length) && std::isfinite(1.0 / length)) continue;
    throw std::invalid_argument("semi-axis " + std::to_string(i) + " of an ellipsoid is " +
                                std::to_string(length) +
                                ": it must be positive and finite, in the unit of the points");
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = i; j < 3; ++j) {
      const double product = axes[3 * i] * axes[3 * j] + axes[3 * i + 1] * axes[3 * j + 1] +
                             axes[3 * i + 2] * axes[3 * j + 2];
      if (std::abs(product - (i == j ? 1.0 : 0.0)) <= 1e-9) continue;
      throw std::invalid_argument("the axes of an ellipsoid, " + listed(axes) +
                                  ", are no orthonormal rows (rows " + std::to_string(i) + " and " +
                                  std::to_string(j) + ")");
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

MetricField3::MetricField3(std::vector<Region> regions) {
  for (std::size_t r = 0; r < regions.size(); ++r) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
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
      if (box.min[0] <= p[0] && p[0] <= box.max[0] && box.min[1] <= p[1] && p[1] <= box.max[1] &&
          box.min[2] <= p[2] && p[2] <= box.max[2])
        return region.map;
    }
    return kIdentityMap3;
  };
}

MetricField3::MetricField3(std::function<LinearMap3(const Point&)> map_at)
    : map_at_(std::move(map_at)) {
  if (!map_at_) throw std::invalid_argument("a field of metrics has no function; give one");
}

}  // namespace terrace::tri
