// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

template <std::size_t kCorners>
double corner_distance(const std::array<Point3, kCorners>& a,
                       const std::array<Point3, kCorners>& b) {
  // Halves, as differences may leave the range of double; relative to the largest, as squares may.
  double largest = 0.0;
  for (const Point3& p : a) {
    for (const Point3& q : b) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        largest = std::max(largest, std::abs(0.5 * p[axis] - 0.5 * q[axis]));
      }
    }
  }
  if (largest == 0.0) return 0.0;
  std::array<std::array<double, kCorners>, kCorners> squares{};
  for (std::size_t i = 0; i < kCorners; ++i) {
    for (std::size_t j = 0; j < kCorners; ++j) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double d = (0.5 * a[i][axis] - 0.5 * b[j][axis]) / largest;
        squares[i][j] += d * d;
      }
    }
  }
  std::array<std::size_t, kCorners> match{};
  std::iota(match.begin(), match.end(), std::size_t{0});
  double least = std::numeric_limits<double>::infinity();
  do {
    std::array<double, kCorners> terms{};
    for (std::size_t i = 0; i < kCorners; ++i) terms[i] = squares[i][match[i]];
    std::sort(terms.begin(), terms.end());  // so that the sum is symmetric to the last bit
    const double sum = std::accumulate(terms.begin(), terms.end(), 0.0);
    least = std::min(least, sum);
  } while (std::next_permutation(match.begin(), match.end()));
  return 2.0 * (largest * std::sqrt(least / static_cast<double>(kCorners)));
}

}  // namespace

double segment_distance(const Segment& a, const Segment& b) { return corner_distance(a, b); }
double triangle_distance(const Triangle& a, const Triangle& b) { return corner_distance(a, b); }

}  // namespace terrace::cluster
