// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/cluster/point.hpp"

/// The representation of points for linkage. Private to linkage.

namespace terrace::cluster {

/// Units of work of one distance that the caller computes, see base::StopTicks.
inline constexpr std::size_t kTicksOfDistance = 64;

/// Copies of points, scaled by a power of two so that squares of distances do not overflow, nor
/// underflow above 1e-150 of the largest coordinate. Scaling is exact, so distances equal those of
/// the given points to the last bit.
class LinkagePoints {
 public:
  /// Throws std::invalid_argument for coordinates that are not finite or beyond 1e307, and for too
  /// many points.
  explicit LinkagePoints(std::span<const Point3> points);
  [[nodiscard]] const std::vector<Point3>& scaled() const { return scaled_; }
  /// Returns the unscaled distance for the square of a scaled one.
  [[nodiscard]] double height(double square) const;
  /// Returns e such that lengths are 2^e times the scaled lengths.
  [[nodiscard]] int exponent() const { return exponent_; }

 private:
  std::vector<Point3> scaled_;
  int exponent_ = 0;
};

/// Returns "the distance of 3 and 5", for messages.
[[nodiscard]] std::string pair_text(std::size_t i, std::size_t j);

/// Throws std::invalid_argument unless the distance is from 0 to `most`. The message names the
/// pair.
void check_distance(double value, double most, std::size_t i, std::size_t j);

/// Returns the squared distance, symmetric to the last bit.
[[nodiscard]] inline double squared_distance(const Point3& p, const Point3& q) {
  const double dx = p[0] - q[0];
  const double dy = p[1] - q[1];
  const double dz = p[2] - q[2];
  return dx * dx + dy * dy + dz * dz;
}

}  // namespace terrace::cluster
