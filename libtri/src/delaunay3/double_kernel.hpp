// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "in_sphere.hpp"

/// Exact predicates on doubles. One evaluation in double with an error bound nearly always decides.
/// The remaining cases use integers if the coordinates are integers, otherwise CGAL.

namespace terrace::tri::spatial {

struct DoubleKernel {
  using Coord = double;
  using Point = std::array<Coord, 3>;

  struct alignas(32) Vertex {
    Point point;
    std::uint32_t incident;  ///< see mesh.hpp
  };

  static bool valid(const Point& p) {
    return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
  }

  /// The sign of det(b - a, c - a, d - a): > 0 if the four are in order, 0 if coplanar.
  static int orientation(const Point& a, const Point& b, const Point& c, const Point& d) {
    const Vector u = difference(b, a);
    const Vector v = difference(c, a);
    const Vector w = difference(d, a);
    const double det = (u.y * v.z - u.z * v.y) * w.x + (u.z * v.x - u.x * v.z) * w.y +
                       (u.x * v.y - u.y * v.x) * w.z;
    // The product of the three lengths bounds each of three sums of products. 8 relative errors of
    // u = 2^-53 enter (3 in differences, 2 in minors, 1 and 2 in the last step), so the bound is 24
    // u times the product of lengths, here squared and rounded up. Extreme sizes are left to the
    // exact test.
    const double size = u.square() * v.square() * w.square();
    if (det * det > 7.5e-30 * size && size > 0x1p-900 && size < 0x1p900) [[likely]]
      return det > 0 ? 1 : -1;
    return orientation_exact(a, b, c, d);
  }
  /// True if a, b, c are collinear.
  static bool collinear(const Point& a, const Point& b, const Point& c);

  /// The property that all points of a mesh share: all coordinates are integer multiples of 2^k,
  /// with the largest such k. Differences on a grid are then small multiples, for which doubles are
  /// exact.
  class Lattice {
   public:
    void add(const Point& p) {
      if (exponent_ < kMinExponent) return;
      for (const double c : p) add(c);
    }
    /// Sphere tests are exact if the fifth power of the largest square is below this.
    [[nodiscard]] double exact_fifth() const { return exact_fifth_; }

   private:
    static constexpr int kMinExponent = -80;
    static constexpr int kMaxExponent = 80;
    void add(double c);
    int exponent_ = kMaxExponent;
    double exact_fifth_ = kExactFifth * 0x1p800;
  };

  /// A point that is tested against many spheres.
  class Probe {
   public:
    Probe(const Point& p, const Lattice& lattice)
        : x_{p[0], p[0]}, y_{p[1], p[1]}, z_{p[2], p[2]}, exact_fifth_(lattice.exact_fifth()) {}

    /// The position of the point relative to the sphere through four vertices in order, after the
    /// perturbation.
    [[gnu::always_inline]] Verdict side(const Vertex& a, const Vertex& b, const Vertex& c,
                                        const Vertex& d) const {
      const auto pairs = [](const Vertex& v, const Vertex& w, std::size_t k) {
        return Pair{v.point[k], w.point[k]};
      };
      const Rows rows = {pairs(a, b, 0) - x_, pairs(c, d, 0) - x_, pairs(a, b, 1) - y_,
                         pairs(c, d, 1) - y_, pairs(a, b, 2) - z_, pairs(c, d, 2) - z_};
      const InSphere test = in_sphere_value(rows);
      // As in IntKernel, plus one relative error for each of the five differences in a product: 16
      // * 12 u < 2.2e-14. Sizes near underflow and overflow are left to the exact test.
      const double fifth = test.largest * test.largest * test.largest * test.largest * test.largest;
      if (!(test.value * test.value > 4.9e-28 * fifth && fifth > 0x1p-900 && fifth < 0x1p900))
          [[unlikely]] {
        if (!(fifth < exact_fifth_)) return Verdict::open;
        if (test.value == 0)
          return inside_small_perturbed_sphere(rows) ? Verdict::in : Verdict::out;
      }
      return test.value > 0 ? Verdict::in : Verdict::out;
    }

   private:
    Pair x_, y_, z_;
    double exact_fifth_;
  };

  /// > 0 if p is inside the sphere through a, b, c, d, which are in order, or 0 if on it.
  static int in_sphere(const Point& a, const Point& b, const Point& c, const Point& d,
                       const Point& p);

  /// < 0 if a is nearer to p than b.
  static int compare_distance(const Point& p, const Point& a, const Point& b);

 private:
  struct Vector {
    double x, y, z;
    [[nodiscard]] double square() const { return x * x + y * y + z * z; }
  };
  static Vector difference(const Point& a, const Point& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  }
  static int orientation_exact(const Point& a, const Point& b, const Point& c, const Point& d);
};

}  // namespace terrace::tri::spatial
