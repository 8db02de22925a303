// SPDX-License-Identifier: Apache-2.0
#include "linkage/points.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "ground.hpp"
#include "terrace/cluster/dendrogram.hpp"

namespace terrace::cluster {

LinkagePoints::LinkagePoints(std::span<const Point3> points) {
  if (points.size() > kMostDendrogramPoints) {
    throw std::invalid_argument(std::to_string(points.size()) +
                                " points are too many: a dendrogram has at most 2^31");
  }
  const auto fail = [](std::size_t i, const char* what) {
    throw std::invalid_argument("point " + std::to_string(i) + " has a coordinate " + what);
  };
  if (const std::size_t bad = first_not_finite(points); bad < points.size()) {
    fail(bad, "that is not finite; leave such points out");
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const double v : points[i]) largest = std::max(largest, std::fabs(v));
    if (largest > 1e307) fail(i, "beyond 1e307; scale the points");
  }
  scaled_.assign(points.begin(), points.end());
  if (largest > 0.0) std::frexp(largest, &exponent_);
  // Scales in two steps, because the factor itself may overflow a double. The sum turns -0 into 0.
  const double half = std::ldexp(1.0, -(exponent_ / 2));
  const double rest = std::ldexp(1.0, -(exponent_ - exponent_ / 2));
  for (Point3& p : scaled_) {
    for (double& v : p) v = v * half * rest + 0.0;
  }
}

double LinkagePoints::height(double square) const {
  return std::ldexp(std::sqrt(square), exponent_);
}

std::string pair_text(std::size_t i, std::size_t j) {
  return "the distance of " + std::to_string(std::min(i, j)) + " and " +
         std::to_string(std::max(i, j));
}

void check_distance(double value, double most, std::size_t i, std::size_t j) {
  if (value >= 0.0 && value <= most) return;
  throw std::invalid_argument(pair_text(i, j) + " is " + std::to_string(value) +
                              "; distances must be finite and not negative");
}

}  // namespace terrace::cluster
