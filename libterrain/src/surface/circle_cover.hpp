// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "surface/store_window.hpp"

/// Where a point would change a Delaunay triangulation: closed circumcircles.
/// Rounding only enlarges them, and tests are written so that NaN meets everything.

namespace terrace::terrain {

/// The closed half-plane to the right of a line from a to b, or slightly more.
struct HalfPlane {
  std::array<double, 2> a{}, b{};

  [[nodiscard]] bool meets(const StoredBox& box) const { return !(leftness(box) > 0); }
  /// Returns how far left of the line the rightmost corner of the box is, in a unit that allows
  /// only comparisons. Positive only if the corner is certainly left of the line.
  [[nodiscard]] double leftness(const StoredBox& box) const {
    const double ux = b[0] - a[0], uy = b[1] - a[1];
    // The cross product of u and (p - a) is smallest at this corner.
    const double px = (uy > 0 ? box.max[0] : box.min[0]) - a[0];
    const double py = (ux > 0 ? box.min[1] : box.max[1]) - a[1];
    const double first = ux * py, second = uy * px;
    // Three roundings for each product, and one for the difference.
    constexpr double kEpsilon = 8 * std::numeric_limits<double>::epsilon();
    return first - second - kEpsilon * (std::abs(first) + std::abs(second)) - kTiny;
  }

 private:
  /// An upper bound of what underflow can lose.
  static constexpr double kTiny = 1e-300;
};

/// A region of the plane that contains the closed circumcircle of a triangle.
struct CircleCover {
  bool has_plane = false, has_disk = false;
  HalfPlane plane{};
  std::array<double, 2> near{};    ///< a corner
  std::array<double, 2> centre{};  ///< relative to `near`
  double radius = 0;

  /// The corners must be counter-clockwise.
  static CircleCover of_triangle(const std::array<std::array<double, 2>, 3>& corners) {
    const auto& [a, b, c] = corners;
    constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
    const double ux = b[0] - a[0], uy = b[1] - a[1], vx = c[0] - a[0], vy = c[1] - a[1];
    const double first = ux * vy, second = uy * vx;
    const double doubled = 2 * (first - second);
    // Differences are accurate to half an epsilon, their products to two.
    const double doubt = 8 * kEpsilon * (std::abs(first) + std::abs(second));
    const double uu = ux * ux + uy * uy, vv = vx * vx + vy * vy;
    if (doubled > 1e3 * doubt && doubled > 1e-290 && doubled < 1e290) {
      CircleCover cover;
      cover.has_disk = true;
      cover.near = a;
      cover.centre = {(vy * uu - uy * vv) / doubled, (ux * vv - vx * uu) / doubled};
      const double size =
          std::sqrt(cover.centre[0] * cover.centre[0] + cover.centre[1] * cover.centre[1]);
      const double numerator =
          (std::abs(vy) + std::abs(vx)) * uu + (std::abs(uy) + std::abs(ux)) * vv;
      const double error =
          1.01 * (16 * kEpsilon * numerator + 2 * size * doubt) / doubled + 8 * kEpsilon * size;
      // The corner is on the circle, so an error of the centre is also one of the radius.
      cover.radius = size + 3 * error;
      // If the cover is much larger than the circle, treat the triangle as a needle.
      if (error <= 0.01 * size) return cover;
    }
    return of_needle(a, b, c);
  }

  [[nodiscard]] bool meets(const StoredBox& box) const {
    return (has_disk && disk_meets(box)) || (has_plane && plane.meets(box));
  }
  /// The less of a box is in the region, the larger the depth. Only for comparing boxes.
  [[nodiscard]] double depth(const StoredBox& box) const {
    if (has_plane) return plane.leftness(box);
    double sum = 0;
    for (std::size_t k = 0; k < 2; ++k) {
      const double d = 0.5 * (box.min[k] + box.max[k]) - near[k] - centre[k];
      sum += d * d;
    }
    return sum;
  }
  /// A lower bound of depth() over all points in the box, up to rounding.
  [[nodiscard]] double least_depth(const StoredBox& box) const {
    if (has_plane) return plane.leftness(box);
    double sum = 0;
    for (std::size_t k = 0; k < 2; ++k) {
      const double middle = near[k] + centre[k];
      const double out = std::max({box.min[k] - middle, middle - box.max[k], 0.0});
      sum += out * out;
    }
    return sum;
  }
  /// Returns a box around the disk; everything if there is a half-plane.
  [[nodiscard]] StoredBox bounds() const {
    constexpr double kAll = std::numeric_limits<double>::infinity();
    if (has_plane || !(radius < kAll)) return {{-kAll, -kAll}, {kAll, kAll}};
    StoredBox box;
    for (std::size_t k = 0; k < 2; ++k) {
      const double middle = near[k] + centre[k];
      const double reach =
          radius + 4 * std::numeric_limits<double>::epsilon() * (std::abs(near[k]) + radius);
      box.min[k] = middle - reach;
      box.max[k] = middle + reach;
    }
    return box;
  }

 private:
  /// Covers everything behind the longest side, ab. In front of it, covers a cap of the circle: the
  /// angle at c is at least 60 degrees, so all its points are within 0.87 times the length of ab of
  /// the middle of ab.
  static CircleCover of_needle(std::array<double, 2> a, std::array<double, 2> b,
                               std::array<double, 2> c) {
    double size = 0;
    for (std::size_t k = 0; k < 2; ++k) {
      size += std::max({a[k], b[k], c[k]}) - std::min({a[k], b[k], c[k]});
    }
    const auto square = [size](const std::array<double, 2>& p, const std::array<double, 2>& q) {
      const double dx = (q[0] - p[0]) / size, dy = (q[1] - p[1]) / size;
      return dx * dx + dy * dy;
    };
    const double ab = square(a, b), bc = square(b, c), ca = square(c, a);
    if (bc >= ab && bc >= ca) {
      std::swap(a, b);  // from (a, b, c) to (b, c, a)
      std::swap(b, c);
    } else if (ca >= ab && ca >= bc) {
      std::swap(a, c);  // to (c, a, b)
      std::swap(b, c);
    }
    CircleCover cover;
    cover.has_plane = cover.has_disk = true;
    cover.plane = {a, b};
    cover.near = a;
    cover.centre = {0.5 * (b[0] - a[0]), 0.5 * (b[1] - a[1])};
    cover.radius = 0.9 * size;
    return cover;
  }

  [[nodiscard]] bool disk_meets(const StoredBox& box) const {
    constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
    double sum = 0, doubt = 0;
    for (std::size_t k = 0; k < 2; ++k) {
      const double low = box.min[k] - near[k], high = box.max[k] - near[k];
      const double out = std::max(low - centre[k], centre[k] - high);
      doubt += std::abs(low) + std::abs(high);
      if (out > 0) sum += out * out;
      if (out != out) return true;
    }
    const double limit = radius + 8 * kEpsilon * (doubt + radius);
    return !(sum > limit * limit * (1 + 8 * kEpsilon));
  }
};

}  // namespace terrace::terrain
