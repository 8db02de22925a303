// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "terrace/tri/multiresolution_source.hpp"

/// Elliptical metrics of the plane, and fields of them. The length of a vector v is |M v|, where M
/// maps an ellipse onto the unit circle: every radius of the ellipse has length 1. Source: J.
/// Skala, Algorithms for manipulating large geometric data, 4.1.2, 4.1.3 and 7.4.

namespace terrace::tri {

/// A linear map of the plane, row-major. As a metric: finite and invertible. Maps that differ by a
/// turn or a mirror, or by a factor, triangulate alike; a symmetric positive definite one is the
/// usual choice.
using LinearMap2 = std::array<double, 4>;

inline constexpr LinearMap2 kIdentityMap2{1, 0, 0, 1};

/// The symmetric map of the ellipse with semi-axis `a` along the direction `angle_degrees`,
/// counter-clockwise from +x, and `b` across it (in the unit of the points). So the entry off the
/// diagonal is (1/a - 1/b) sin cos; 4.5 of the thesis as printed has the angle clockwise.
/// Throws: std::invalid_argument on a semi-axis that is not positive and finite, whose reciprocal
/// is infinite, or an angle that is not finite.
[[nodiscard]] LinearMap2 ellipse_map(double a, double b, double angle_degrees);
/// The same where (cosine, sine) of the angle are known, for results that must not depend on the
/// machine's own sine. Throws as above; and if their squares do not add up to 1 within 1e-9.
[[nodiscard]] LinearMap2 ellipse_map(double a, double b, const std::array<double, 2>& direction);
/// A map whose lengths are those of a row-major map of space on vectors without z: its upper left
/// part, bit for bit, if it leaves z alone; else a triangular map, rounded. Throws:
/// std::invalid_argument if that is not finite or not invertible.
[[nodiscard]] LinearMap2 plane_map(const std::array<double, 9>& map);

/// Throws: std::invalid_argument if the map is no metric; `what` names it in the message.
void check_metric(const LinearMap2& map, const std::string& what);

/// A metric as a function of the position: constant in regions.
class MetricField2 {
 public:
  using Point = std::array<double, 2>;
  struct Region {
    Box3 box;  ///< closed; only x and y count, see box2(). Infinite sides are allowed.
    LinearMap2 map = kIdentityMap2;
  };

  /// An elliptical metric in each box, the Euclidean one outside (7.4); where boxes overlap the
  /// first of the list holds. Throws: std::invalid_argument on an empty box, one that is not a
  /// number, or a map that is no metric, naming its index.
  explicit MetricField2(std::vector<Region> regions);
  /// Any function. A region is where it gives one and the same map, whatever its shape; so a metric
  /// that varies must be made constant piece by piece.
  explicit MetricField2(std::function<LinearMap2(const Point&)> map_at);

  /// The map that holds at a position.
  [[nodiscard]] LinearMap2 operator()(const Point& position) const { return map_at_(position); }

 private:
  std::function<LinearMap2(const Point&)> map_at_;
};

}  // namespace terrace::tri
