// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cassert>
#include <cmath>

#include "facility/corner_distance.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

double distance_of(std::span<const Point3> a, std::span<const Point3> b, bool ordered) {
  // Halves are used because differences may overflow; the scale is the largest, because squares
  // may.
  double largest = 0.0;
  for (const Point3& p : a) {
    for (const Point3& q : b) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        largest = std::max(largest, std::abs(0.5 * p[axis] - 0.5 * q[axis]));
      }
    }
  }
  if (largest == 0.0) return 0.0;
  return 2.0 * (largest * corner_distance(a.size(), ordered, [&](std::size_t i, std::size_t j) {
                  double square = 0.0;
                  for (std::size_t axis = 0; axis < 3; ++axis) {
                    const double d = (0.5 * a[i][axis] - 0.5 * b[j][axis]) / largest;
                    square += d * d;
                  }
                  return square;
                }));
}

}  // namespace

double segment_distance(const Segment& a, const Segment& b) { return distance_of(a, b, false); }
double triangle_distance(const Triangle& a, const Triangle& b) { return distance_of(a, b, false); }

double polyline_distance(std::span<const Point3> a, std::span<const Point3> b) {
  assert(!a.empty() && a.size() == b.size());
  return distance_of(a, b, true);
}

}  // namespace terrace::cluster
