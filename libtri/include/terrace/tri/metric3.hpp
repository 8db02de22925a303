// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "terrace/tri/multiresolution_source.hpp"

/// Elliptical metrics of space, and fields of them, as metric2.hpp of the plane. The length of a
/// vector v is |M v|, where M maps an ellipsoid onto the unit sphere: every radius of the ellipsoid
/// has length 1. So |M v|^2 = v^T Q v with the symmetric positive definite Q = M^T M. Source: J.
/// Skala, Algorithms for manipulating large geometric data, 4.1.2, 4.1.3 and 7.4.

namespace terrace::tri {

/// A linear map of space, row-major. As a metric: finite and invertible. Maps that differ by a turn
/// or a mirror, or by a factor, triangulate alike; a symmetric positive definite one is the usual
/// choice.
using LinearMap3 = std::array<double, 9>;

inline constexpr LinearMap3 kIdentityMap3{1, 0, 0, 0, 1, 0, 0, 0, 1};

/// The symmetric map of the ellipsoid whose semi-axis i (in the unit of the points) points along
/// row i of `axes`, three orthonormal vectors. Throws: std::invalid_argument on a semi-axis that is
/// not positive and finite, whose reciprocal is infinite, or rows that are not orthonormal to 1e-9.
[[nodiscard]] LinearMap3 ellipsoid_map(const std::array<double, 3>& semi_axes,
                                       const LinearMap3& axes = kIdentityMap3);

/// Throws: std::invalid_argument if the map is no metric; `what` names it in the message. Exact.
void check_metric(const LinearMap3& map, const std::string& what);

/// The length |M v| of a vector in the metric, rounded.
[[nodiscard]] double metric_length(const LinearMap3& map, const std::array<double, 3>& vector);

/// A metric as a function of the position: constant in regions.
class MetricField3 {
 public:
  using Point = std::array<double, 3>;
  struct Region {
    Box3 box;  ///< closed. Infinite sides are allowed.
    LinearMap3 map = kIdentityMap3;
  };

  /// An elliptical metric in each box, the Euclidean one outside (7.4); where boxes overlap the
  /// first of the list holds. Throws: std::invalid_argument on an empty box, one that is not a
  /// number, or a map that is no metric, naming its index.
  explicit MetricField3(std::vector<Region> regions);
  /// Any function. A region is where it gives one and the same map, whatever its shape; so a metric
  /// that varies must be made constant piece by piece.
  explicit MetricField3(std::function<LinearMap3(const Point&)> map_at);

  /// The map that holds at a position.
  [[nodiscard]] LinearMap3 operator()(const Point& position) const { return map_at_(position); }

 private:
  std::function<LinearMap3(const Point&)> map_at_;
};

}  // namespace terrace::tri
