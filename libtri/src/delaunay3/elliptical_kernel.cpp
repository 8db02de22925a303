// SPDX-License-Identifier: Apache-2.0
#include "elliptical_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include <CGAL/Exact_rational.h>
#include <CGAL/Mpzf.h>

#include "int_kernel.hpp"

namespace terrace::tri::spatial {
namespace {

// Only sums and products are needed, so the ring of binary fractions suffices. It is far faster
// than rationals.
#ifdef CGAL_HAS_MPZF
using Number = CGAL::Mpzf;
#else
using Number = CGAL::Exact_rational;
#endif
using Point = DoubleKernel::Point;

template <class T>
using Triple = std::array<T, 3>;

Triple<Number> exactly(const Point& from, const Point& to) {
  return {Number(to[0]) - Number(from[0]), Number(to[1]) - Number(from[1]),
          Number(to[2]) - Number(from[2])};
}

template <class T>
T determinant(const Triple<T>& e, const Triple<T>& f, const Triple<T>& g) {
  return T(e[0] * f[1] - e[1] * f[0]) * g[2] + T(f[0] * g[1] - f[1] * g[0]) * e[2] +
         T(g[0] * e[1] - g[1] * e[0]) * f[2];
}

/// The upper right of a symmetric matrix: xx, xy, xz, yy, yz, zz.
constexpr std::size_t kRow[6] = {0, 0, 0, 1, 1, 2};
constexpr std::size_t kColumn[6] = {0, 1, 2, 1, 2, 2};

/// M^T M.
template <class T>
std::array<T, 6> square_of(const LinearMap3& m) {
  std::array<T, 6> result;
  for (std::size_t k = 0; k < 6; ++k) {
    result[k] = T(0);
    for (std::size_t i = 0; i < 3; ++i)
      result[k] = result[k] + T(m[3 * i + kRow[k]]) * T(m[3 * i + kColumn[k]]);
  }
  return result;
}

/// Differences of integers that are small enough for everything computed from them to fit into 128
/// bits.
bool small_difference(const Point& from, const Point& to, Triple<Int128>& result) {
  constexpr double kLimit = 0x1p23;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(std::abs(to[k]) < 0x1p52 && std::abs(from[k]) < 0x1p52)) return false;
    const double difference = to[k] - from[k];  // exact if both are integers
    if (!(std::abs(difference) < kLimit)) return false;
    const auto integers = static_cast<std::int64_t>(to[k]);
    if (static_cast<double>(integers) != to[k] ||
        static_cast<double>(static_cast<std::int64_t>(from[k])) != from[k])
      return false;
    result[k] = static_cast<std::int64_t>(difference);
  }
  return true;
}

}  // namespace

struct QuadraticForm::Exact {
  std::array<Number, 6> q;  ///< of the given map
  /// times a power of two, each with a relative error of at most 2^-52, or 0
  std::array<double, 6> near;
  std::array<bool, 6> is_zero;  ///< by entry of q

  /// u^T Q v.
  [[nodiscard]] Number product(const Triple<Number>& u, const Triple<Number>& v) const {
    Number sum = q[0] * (u[0] * v[0]) + q[3] * (u[1] * v[1]) + q[5] * (u[2] * v[2]);
    for (const std::size_t k : {1u, 2u, 4u})
      if (!is_zero[k]) sum = sum + q[k] * (u[kRow[k]] * v[kColumn[k]] + u[kColumn[k]] * v[kRow[k]]);
    return sum;
  }

  /// The sign of the sum of q times the integers, component by component; 2 if unknown.
  [[nodiscard]] int sign_of_sum(const std::array<Int128, 6>& integers) const {
    double sum = 0, size = 0;
    bool zero = true;
    for (std::size_t k = 0; k < 6; ++k) {
      if (is_zero[k] || integers[k] == 0) continue;
      zero = false;
      if (std::abs(near[k]) < 0x1p-400) return 2;
      const double term = near[k] * static_cast<double>(integers[k]);
      sum += term;
      size += std::abs(term);
    }
    if (zero) return 0;
    // Errors: factors 2 u and u, product u, and six sums, which are themselves rounded.
    if (std::abs(sum) > 16 * 0x1p-53 * size) return sum > 0 ? 1 : -1;
    return 2;
  }
};

constinit thread_local const QuadraticForm* EllipticalKernel::form_ = nullptr;

QuadraticForm::QuadraticForm(const EllipticalMetric3& metric) : map_(metric.map()) {
  int exponent = 0;
  double largest = 0;
  for (const double m : map_) largest = std::max(largest, std::abs(m));
  std::frexp(largest, &exponent);
  // Terms that underflow here are too small to matter to the filters.
  LinearMap3 near_one = map_;
  for (double& m : near_one) m = std::ldexp(m, -exponent);

  Exact exact;
  exact.q = square_of<Number>(map_);
  using Rational = CGAL::Exact_rational;
  const std::array<Rational, 6> q = square_of<Rational>(near_one);
  for (std::size_t k = 0; k < 6; ++k) {
    exact.near[k] = CGAL::to_double(q[k]);
    exact.is_zero[k] = CGAL::sign(exact.q[k]) == CGAL::ZERO;
  }
  exact_ = std::make_shared<const Exact>(std::move(exact));

  // The Cholesky factor with exact remainders, so that no entry suffers from cancellation.
  spread_ = filter2_ = std::numeric_limits<double>::infinity();
  const auto root = [](const Rational& square) { return std::sqrt(CGAL::to_double(square)); };
  if (CGAL::sign(q[0]) != CGAL::POSITIVE) return;
  const Rational s11 = q[3] - q[1] * q[1] / q[0], s12 = q[4] - q[1] * q[2] / q[0];
  const Rational s22 = q[5] - q[2] * q[2] / q[0];
  if (CGAL::sign(s11) != CGAL::POSITIVE) return;
  r00_ = root(q[0]);
  r01_ = CGAL::to_double(q[1]) / r00_;
  r02_ = CGAL::to_double(q[2]) / r00_;
  r11_ = root(s11);
  r12_ = CGAL::to_double(s12) / r11_;
  r22_ = root(Rational(s22 - s12 * s12 / s11));
  // Below this underflow would matter, and filters decide little anyway.
  constexpr double kMinDiagonal = 0x1p-28;
  if (!(std::min({r00_, r11_, r22_}) > kMinDiagonal)) {
    r00_ = r01_ = r02_ = r11_ = r12_ = r22_ = 0;
    return;
  }
  // |R| |R^-1|, upper triangular with ones on the diagonal.
  const double i01 = std::abs(r01_) / (r00_ * r11_), i12 = std::abs(r12_) / (r11_ * r22_);
  const double i02 = (std::abs(r01_ * r12_) / r11_ + std::abs(r02_)) / (r00_ * r22_);
  const double p01 = r00_ * i01 + std::abs(r01_) / r11_;
  const double p12 = r11_ * i12 + std::abs(r12_) / r22_;
  const double p02 = r00_ * i02 + std::abs(r01_) * i12 + std::abs(r02_) / r22_;
  const double by_rows = std::max(1 + p01 + p02, 1 + p12);
  const double by_columns = std::max(1 + p01, 1 + p02 + p12);
  spread_ = std::sqrt(by_rows * by_columns) * (1 + 0x1p-40);
  // Second-order errors would matter otherwise.
  if (!(spread_ < 0x1p28)) return;
  const double bound = (160 + 200 * spread_) * 0x1p-53;
  filter2_ = bound * bound * 1.01;
}

int EllipticalKernel::in_sphere(const Point& a, const Point& b, const Point& c, const Point& d,
                                const Point& p) {
  const std::array<const Point*, 4> corner = {&a, &b, &c, &d};
  const QuadraticForm::Exact& q = *form_->exact_;
  // Ties are frequent on grids and must be cheap there. The value is a sum over the entries of Q
  // times integers. At a tie most of these integers vanish one by one.
  std::array<Triple<Int128>, 4> integers;
  bool is_integer = true;
  for (std::size_t i = 0; i < 4 && is_integer; ++i)
    is_integer = small_difference(p, *corner[i], integers[i]);
  if (is_integer) {
    std::array<Int128, 6> sum{};
    for (std::size_t i = 0; i < 4; ++i) {
      Int128 minor =
          determinant(integers[(i + 1) & 3], integers[(i + 2) & 3], integers[(i + 3) & 3]);
      if (i % 2 != 0) minor = -minor;
      for (std::size_t k = 0; k < 6; ++k) {
        const Int128 product = integers[i][kRow[k]] * integers[i][kColumn[k]];
        sum[k] += minor * (kRow[k] == kColumn[k] ? product : 2 * product);
      }
    }
    const int sign = q.sign_of_sum(sum);
    if (sign != 2) return sign;
  }
  std::array<Triple<Number>, 4> r;
  for (std::size_t i = 0; i < 4; ++i) r[i] = exactly(p, *corner[i]);
  Number sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Number term =
        determinant(r[(i + 1) & 3], r[(i + 2) & 3], r[(i + 3) & 3]) * q.product(r[i], r[i]);
    sum = i % 2 == 0 ? Number(sum + term) : Number(sum - term);
  }
  return static_cast<int>(CGAL::sign(sum));
}

int EllipticalKernel::compare_distance(const Point& p, const Point& a, const Point& b) {
  const auto square = [](const Point& m) { return m[0] * m[0] + m[1] * m[1] + m[2] * m[2]; };
  const double to_a = square(mapped(a, p)), to_b = square(mapped(b, p));
  // 2 * 9 u spread for the maps and 3 u for the squares, each.
  const double bound = (20 * form_->spread_ + 8) * 0x1p-53 * (to_a + to_b);
  if (form_->spread_ < 0x1p28 && to_a + to_b < 0x1p900 && std::abs(to_a - to_b) > bound + 0x1p-900)
    return to_a < to_b ? -1 : 1;
  const QuadraticForm::Exact& q = *form_->exact_;
  const Triple<Number> u = exactly(p, a), v = exactly(p, b);
  return static_cast<int>(CGAL::sign(q.product(u, u) - q.product(v, v)));
}

int EllipticalKernel::angle(const Point& from, const Point& a, const Point& b) {
  return static_cast<int>(CGAL::sign(form_->exact_->product(exactly(from, a), exactly(from, b))));
}

bool EllipticalKernel::in_smallest_sphere(const Point& a, const Point& b, const Point& c,
                                          const Point& d) {
  // d is on the edge opposite to an angle that is not acute; at a right angle both cases coincide.
  if (angle(a, b, c) <= 0) return angle(d, b, c) < 0;
  if (angle(b, a, c) <= 0) return angle(d, a, c) < 0;
  if (angle(c, a, b) <= 0) return angle(d, a, b) < 0;
  // The centre is (f e + g f) / (2 n), where e and f are the edges from a. Only scalar products are
  // needed.
  const QuadraticForm::Exact& q = *form_->exact_;
  const Triple<Number> e = exactly(a, b), f = exactly(a, c), v = exactly(a, d);
  const Number ee = q.product(e, e), ff = q.product(f, f), ef = q.product(e, f);
  const Number n = ee * ff - ef * ef;
  return CGAL::sign(n * q.product(v, v) - ff * (ee - ef) * q.product(v, e) -
                    ee * (ff - ef) * q.product(v, f)) == CGAL::NEGATIVE;
}

}  // namespace terrace::tri::spatial
