// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "double_kernel.hpp"
#include "terrace/tri/metric.hpp"

/// Exact predicates in an elliptical metric, on the original points: only the filters map
/// differences. Orientation is the same in all linear metrics. Only spheres become ellipsoids, and
/// distances become lengths of mapped vectors.

namespace terrace::tri::spatial {

/// A metric prepared for the predicates, which use its map M only as Q = M^T M.
///
/// Filters use the upper triangular R with R^T R = Q (times a power of two) and a positive
/// diagonal. It differs from M by a rotation or reflection, so it preserves lengths and
/// orientation. Each of its entries is rounded from an exact one, with a relative error of at most
/// 5 u, u = 2^-53. The error of a difference mapped by it is then 9 u |R| |d|, component by
/// component (difference 1, entry 5, product 1, sums 2). As d = R^-1 m, that is 9 u spread() times
/// the length of the mapped difference m.
class QuadraticForm {
 public:
  explicit QuadraticForm(const EllipticalMetric3& metric);

  /// Upper bound of the norm of |R| |R^-1|: 1 for axes along those of the coordinates. Otherwise it
  /// grows with the ratio of the longest semi-axis to the shortest. May be infinite.
  [[nodiscard]] double spread() const { return spread_; }

 private:
  friend class EllipticalKernel;
  struct Exact;
  LinearMap3 map_;
  double r00_ = 0, r01_ = 0, r02_ = 0, r11_ = 0, r12_ = 0, r22_ = 0;
  double spread_ = 0;
  double filter2_ = 0;  ///< see EllipticalKernel::Probe::side()
  std::shared_ptr<const Exact> exact_;
};

/// The algorithms call kernels statically, so a Scope sets the metric of the thread for the
/// duration of a call.
class EllipticalKernel : public DoubleKernel {
 public:
  class Scope {
   public:
    explicit Scope(const QuadraticForm& form) : before_(form_) { form_ = &form; }
    ~Scope() { form_ = before_; }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    const QuadraticForm* before_;
  };
  /// The form of the current scope, for setting it in other threads too.
  static const QuadraticForm& form() { return *form_; }

  /// A property shared by the points would not help, because the numbers of the metric are
  /// arbitrary.
  struct Lattice {
    void add(const Point&) {}
  };

  /// A point that is tested against many ellipsoids.
  class Probe {
   public:
    Probe(const Point& p, Lattice) : x_{p[0], p[0]}, y_{p[1], p[1]}, z_{p[2], p[2]} {
      const QuadraticForm& m = *form_;
      r00_ = both(m.r00_), r01_ = both(m.r01_), r02_ = both(m.r02_);
      r11_ = both(m.r11_), r12_ = both(m.r12_), r22_ = both(m.r22_);
      filter2_ = m.filter2_;
    }

    /// The position of the point relative to the ellipsoid through four vertices in order: the test
    /// of DoubleKernel applied to mapped differences.
    [[gnu::always_inline]] Verdict side(const Vertex& a, const Vertex& b, const Vertex& c,
                                        const Vertex& d) const {
      const auto pairs = [](const Vertex& v, const Vertex& w, std::size_t k) {
        return Pair{v.point[k], w.point[k]};
      };
      const Pair x01 = pairs(a, b, 0) - x_, x23 = pairs(c, d, 0) - x_;
      const Pair y01 = pairs(a, b, 1) - y_, y23 = pairs(c, d, 1) - y_;
      const Pair z01 = pairs(a, b, 2) - z_, z23 = pairs(c, d, 2) - z_;
      const InSphere test = in_sphere_value(
          {r00_ * x01 + r01_ * y01 + r02_ * z01, r00_ * x23 + r01_ * y23 + r02_ * z23,
           r11_ * y01 + r12_ * z01, r11_ * y23 + r12_ * z23, r22_ * z01, r22_ * z23});
      // Let L be the largest squared length of a mapped row. As in IntKernel the operations cause
      // an error of 132 u L^2.5. By Hadamard a 3 x 3 minor is at most L^1.5. If each row has an
      // error of e, minors have an error of 3 e L, squares of 2 e L^0.5 and the four products of 20
      // e L^2, where e is 9 u spread L^0.5. So (160 + 200 spread) u L^2.5 bounds the total. Sizes
      // near underflow and overflow are left to the exact test.
      const double fifth = test.largest * test.largest * test.largest * test.largest * test.largest;
      if (test.value * test.value > filter2_ * fifth && fifth > 0x1p-900 && fifth < 0x1p900)
          [[likely]]
        return test.value > 0 ? Verdict::in : Verdict::out;
      return Verdict::open;
    }

   private:
    static Pair both(double value) { return Pair{value, value}; }
    Pair x_, y_, z_;
    Pair r00_, r01_, r02_, r11_, r12_, r22_;
    double filter2_;
  };

  /// > 0 if p is inside the metric's ellipsoid through a, b, c, d, which are in order, or 0 if on
  /// it.
  static int in_sphere(const Point& a, const Point& b, const Point& c, const Point& d,
                       const Point& p);

  /// < 0 if a is nearer to p than b.
  static int compare_distance(const Point& p, const Point& a, const Point& b);

  /// The sign of q(u, v), where u goes from `from` to a and v from `from` to b: > 0 if the angle is
  /// acute in the metric.
  static int angle(const Point& from, const Point& a, const Point& b);

  /// True if d is inside the metric's smallest ellipsoid that contains the triangle a, b, c, which
  /// is not degenerate. d differs from its corners. Exact.
  static bool in_smallest_sphere(const Point& a, const Point& b, const Point& c, const Point& d);

  /// The difference p - origin mapped by M and rounded, with the same result on every machine.
  static Point by_map(const Point& p, const Point& origin) {
    const LinearMap3& m = form_->map_;
    const double x = p[0] - origin[0], y = p[1] - origin[1], z = p[2] - origin[2];
    return {m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z,
            m[6] * x + m[7] * y + m[8] * z};
  }

  /// The difference p - origin mapped by R, with an error of 9 u spread() times its length.
  static Point mapped(const Point& p, const Point& origin) {
    const QuadraticForm& m = *form_;
    const double x = p[0] - origin[0], y = p[1] - origin[1], z = p[2] - origin[2];
    return {m.r00_ * x + m.r01_ * y + m.r02_ * z, m.r11_ * y + m.r12_ * z, m.r22_ * z};
  }

 private:
  static constinit thread_local const QuadraticForm* form_;
};

}  // namespace terrace::tri::spatial
