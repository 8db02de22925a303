// SPDX-License-Identifier: Apache-2.0
#include "elliptical_kernel.hpp"

#include <algorithm>
#include <cmath>

#include <CGAL/Exact_rational.h>
#include <CGAL/Mpzf.h>

namespace terrace::tri::planar {
namespace {

// Only sums and products are needed, so the ring of binary fractions suffices. It is far faster
// than rationals.
#ifdef CGAL_HAS_MPZF
using Number = CGAL::Mpzf;
#else
using Number = CGAL::Exact_rational;
#endif

struct Vector {
  Number x, y;
  Vector(const DoubleKernel::Point& from, const DoubleKernel::Point& to)
      : x(Number(to[0]) - Number(from[0])), y(Number(to[1]) - Number(from[1])) {}
};

Number cross(const Vector& a, const Vector& b) { return a.x * b.y - a.y * b.x; }

}  // namespace

struct QuadraticForm::Exact {
  Number xx, twice_xy, yy;

  [[nodiscard]] Number square(const Vector& v) const {
    return xx * (v.x * v.x) + twice_xy * (v.x * v.y) + yy * (v.y * v.y);
  }
};

constinit thread_local const QuadraticForm* EllipticalKernel::form_ = nullptr;

QuadraticForm::QuadraticForm(const EllipticalMetric2& metric) {
  const LinearMap2& map = metric.map();
  const auto exact = [](const LinearMap2& m) {
    const Number a(m[0]), b(m[1]), c(m[2]), d(m[3]);
    const Number mixed = a * b + c * d;
    return Exact{a * a + c * c, mixed + mixed, b * b + d * d};
  };
  exact_ = std::make_shared<const Exact>(exact(map));

  int exponent = 0;
  std::frexp(std::max({std::abs(map[0]), std::abs(map[1]), std::abs(map[2]), std::abs(map[3])}),
             &exponent);
  // Terms that underflow here are too small to matter to the filter.
  LinearMap2 near_one = map;
  for (double& m : near_one) m = std::ldexp(m, -exponent);
  const Exact scaled = exact(near_one);
  xx_ = CGAL::to_double(scaled.xx);
  xy_ = CGAL::to_double(scaled.twice_xy) / 2;
  yy_ = CGAL::to_double(scaled.yy);
}

int EllipticalKernel::in_circle_exact(const Point& a, const Point& b, const Point& c,
                                      const Point& p) {
  const Vector u(p, a), v(p, b), w(p, c);
  const QuadraticForm::Exact& q = *form_->exact_;
  return static_cast<int>(CGAL::sign(q.square(u) * cross(v, w) + q.square(v) * cross(w, u) +
                                     q.square(w) * cross(u, v)));
}

int EllipticalKernel::compare_distance(const Point& p, const Point& a, const Point& b) {
  const BoundedAngle to_a = bounded_angle(p, a, a);
  const BoundedAngle to_b = bounded_angle(p, b, b);
  const double difference = to_a.dot - to_b.dot;
  const double size = to_a.dot_size + to_b.dot_size;
  // 9 u for each dot product, 1 u for the difference.
  if (std::abs(difference) > 16 * 0x1p-53 * size + 0x1p-400 && size < 0x1p400)
    return difference < 0 ? -1 : 1;
  const QuadraticForm::Exact& q = *form_->exact_;
  return static_cast<int>(CGAL::sign(q.square(Vector(p, a)) - q.square(Vector(p, b))));
}

}  // namespace terrace::tri::planar
