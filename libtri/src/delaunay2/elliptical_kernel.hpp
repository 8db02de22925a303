// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "double_kernel.hpp"
#include "terrace/tri/metric.hpp"

/// Exact predicates in an elliptical metric, on the original points: nothing is mapped, so nothing
/// is rounded. Orientation and betweenness are the same in all linear metrics. Only circles become
/// ellipses, and distances become lengths of mapped vectors.

namespace terrace::tri::planar {

/// A metric prepared for the predicates, which use its map M only as Q = M^T M.
class QuadraticForm {
 public:
  explicit QuadraticForm(const EllipticalMetric2& metric);

 private:
  friend class EllipticalKernel;
  struct Exact;
  // Q times a power of two such that its largest entry is near 1. Each entry has a relative error
  // of at most 2^-52.
  double xx_, xy_, yy_;
  std::shared_ptr<const Exact> exact_;
};

/// The algorithms call kernels statically, so a Scope sets the metric of the thread for the
/// duration of a call.
class EllipticalKernel : public DoubleKernel {
 public:
  class Scope {
   public:
    explicit Scope(const QuadraticForm& form) : previous_(form_) { form_ = &form; }
    ~Scope() { form_ = previous_; }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    const QuadraticForm* previous_;
  };

  /// > 0 if p is inside the metric's ellipse through the counter-clockwise a, b, c, or 0 if on it.
  /// As in DoubleKernel::in_circle(), with two changes. The cross products of mapped vectors are
  /// those of the vectors times the determinant of M, which does not change their signs. The dot
  /// products are d^T Q e.
  static int in_circle(const Point& a, const Point& b, const Point& c, const Point& p) {
    const BoundedAngle at_a = bounded_angle(a, b, c);
    const BoundedAngle at_p = bounded_angle(p, c, b);
    const double sine = at_a.cross * at_p.dot + at_p.cross * at_a.dot;
    const double size = at_a.cross_size * at_p.dot_size + at_p.cross_size * at_a.dot_size;
    // In units of u = 2^-53: differences 2 + 2; for the dot products: products 1, sum of two 1,
    // entries of Q 2, products with them 1, sums 2; for the cross products: products 1, sum 1. Then
    // product 1 and sum 1. The total is 15 u of the sum of absolute values, which is itself
    // rounded, so 18 u is safe. Otherwise as in DoubleKernel.
    const double largest = at_a.dot_size + at_p.dot_size + at_a.cross_size + at_p.cross_size;
    if (std::abs(sine) > 18 * 0x1p-53 * size + 0x1p-400 && largest < 0x1p200)
      return sine < 0 ? 1 : -1;
    return in_circle_exact(a, b, c, p);
  }

  /// < 0 if a is nearer to p than b.
  static int compare_distance(const Point& p, const Point& a, const Point& b);

 private:
  struct BoundedAngle {
    double cross, dot;
    double cross_size, dot_size;  ///< sums of absolute values of the products
  };
  static BoundedAngle bounded_angle(const Point& apex, const Point& b, const Point& c) {
    const QuadraticForm& q = *form_;
    const double bx = b[0] - apex[0];
    const double by = b[1] - apex[1];
    const double cx = c[0] - apex[0];
    const double cy = c[1] - apex[1];
    const double xy = bx * cy;
    const double yx = by * cx;
    const double xx = q.xx_ * (bx * cx);
    const double yy = q.yy_ * (by * cy);
    const double mixed = q.xy_ * (xy + yx);
    return {xy - yx, xx + mixed + yy, std::abs(xy) + std::abs(yx),
            std::abs(xx) + std::abs(q.xy_) * (std::abs(xy) + std::abs(yx)) + std::abs(yy)};
  }
  static int in_circle_exact(const Point& a, const Point& b, const Point& c, const Point& p);

  static constinit thread_local const QuadraticForm* form_;
};

}  // namespace terrace::tri::planar
