// SPDX-License-Identifier: Apache-2.0
#include "base/orientation.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace terrace::terrain {
namespace {

/// a + b as sum and rounding error, exactly (Knuth).
void two_sum(double a, double b, double& sum, double& rest) {
  sum = a + b;
  const double part = sum - a;
  rest = (a - (sum - part)) + (b - part);
}

/// The sign of a sum of products, exactly: each product is two doubles, and a sorted expansion of
/// non-overlapping parts grows by one double after the other.
class ExactSum {
 public:
  void add_product(double a, double b) {
    const double product = a * b;
    add(std::fma(a, b, -product));
    add(product);
  }
  [[nodiscard]] int sign() const {
    for (std::size_t i = size_; i-- > 0;) {
      if (parts_[i] != 0) return parts_[i] > 0 ? 1 : -1;
    }
    return 0;
  }

 private:
  void add(double value) {
    for (std::size_t i = 0; i < size_; ++i) {
      double sum = 0, rest = 0;
      two_sum(value, parts_[i], sum, rest);
      parts_[i] = rest;
      value = sum;
    }
    parts_[size_++] = value;
  }

  std::array<double, 12> parts_{};
  std::size_t size_ = 0;
};

}  // namespace

int orientation(const Point2& a, const Point2& b, const Point2& c) {
  const double left = (b[0] - a[0]) * (c[1] - a[1]);
  const double right = (b[1] - a[1]) * (c[0] - a[0]);
  const double determinant = left - right;
  const double bound =
      (std::abs(left) + std::abs(right)) * 4 * std::numeric_limits<double>::epsilon();
  if (determinant > bound) return 1;
  if (-determinant > bound) return -1;
  ExactSum sum;
  sum.add_product(a[0], b[1]);
  sum.add_product(-a[1], b[0]);
  sum.add_product(b[0], c[1]);
  sum.add_product(-b[1], c[0]);
  sum.add_product(c[0], a[1]);
  sum.add_product(-c[1], a[0]);
  return sum.sign();
}

}  // namespace terrace::terrain
