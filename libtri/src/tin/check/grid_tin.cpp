// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/grid_tin.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <terrace/base/portable_math.hpp>
#include <terrace/base/simd.hpp>

#include "tin/instruction_set.hpp"
#include "tin/options.hpp"
#include "tin/scan.hpp"

namespace terrace::tri {
namespace {

template <class T>
class Checker {
 public:
  Checker(const GridWindow<T>& window, double tolerance, base::SimdPath set)
      : columns_(window.columns),
        rows_(window.rows),
        heights_(window.heights.data()),
        flags_(window.heights.size() + tin::kCheckLanes, 0),
        window_{heights_, flags_.data(), window.columns, window.rows, tolerance},
        scan_(tin::check_scans(set).of<T>()) {}

  /// Measures a triangle. Returns twice its area, of the points as given.
  double visit(const Point3& a, Point3 b, Point3 c) {
    const double area = turn(a, b, c);
    if (area == 0) return area;
    if (area < 0) std::swap(b, c);
    tin::CheckTriangle triangle{a.data(), b.data(), c.data(), std::fabs(area), {0, 0, 0}};
    if (window_.tolerance > 0) {
      const Point3* const corner[4] = {&a, &b, &c, &a};
      for (int i = 0; i < 3; ++i)
        triangle.margin[i] = window_.tolerance * base::hypot((*corner[i + 1])[0] - (*corner[i])[0],
                                                             (*corner[i + 1])[1] - (*corner[i])[1]);
    }
    if (scan_(window_, triangle, sums_)) count_missing(a, b, c);
    return area;
  }

  GridTinCheck finish() {
    double squares = 0;
    for (int i = 0; i < tin::kCheckLanes; ++i) {
      check_.max_error = std::max(check_.max_error, sums_.max_error[i]);
      squares += sums_.squares[i];
      check_.covered += static_cast<std::size_t>(sums_.covered[i]);
    }
    const std::size_t count = columns_ * rows_;
    for (std::size_t i = 0; i < count; ++i)
      // tests whether the height is finite, in a vectorisable way
      check_.samples += heights_[i] - heights_[i] == T{0} ? 1 : 0;
    for (const std::uint8_t *at = flags_.data(), *const end = at + count;; ++at) {
      at = std::find(at, end, std::uint8_t{0});
      if (at == end) break;
      const auto i = static_cast<std::size_t>(at - flags_.data());
      if (!std::isfinite(heights_[i])) continue;
      check_.uncovered_at.push_back(static_cast<std::uint32_t>(i));
      if (inner(i % columns_, i / columns_)) ++check_.uncovered_inner;
    }
    check_.uncovered = check_.samples - check_.covered;
    if (check_.covered > 0)
      check_.rms_error = std::sqrt(squares / static_cast<double>(check_.covered));
    return std::move(check_);
  }

  void count_inverted() { ++check_.inverted; }

 private:
  static double turn(const Point3& a, const Point3& b, const Point3& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  }

  static bool inside(const Point3& a, const Point3& b, const Point3& c, double x, double y) {
    const Point3 p{x, y, 0};
    return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
  }

  /// Counts samples without data in a triangle, without tolerance.
  void count_missing(const Point3& a, const Point3& b, const Point3& c) {
    const auto begin = [](double least) { return std::max(0.0, std::ceil(least)); };
    const auto end = [](double limit, std::size_t count) {
      return std::min(static_cast<double>(count - 1), limit);
    };
    const double bottom = end(std::max({a[1], b[1], c[1]}), rows_);
    const double right = end(std::max({a[0], b[0], c[0]}), columns_);
    for (double y = begin(std::min({a[1], b[1], c[1]})); y <= bottom; ++y) {
      for (double x = begin(std::min({a[0], b[0], c[0]})); x <= right; ++x) {
        const std::size_t at = static_cast<std::size_t>(y) * columns_ + static_cast<std::size_t>(x);
        if (std::isfinite(heights_[at]) || flags_[at] != 0 || !inside(a, b, c, x, y)) continue;
        flags_[at] = 1;
        ++check_.nodata_covered;
      }
    }
  }

  bool inner(std::size_t x, std::size_t y) const {
    for (std::size_t v = y == 0 ? 0 : y - 1; v < rows_ && v <= y + 1; ++v)
      for (std::size_t u = x == 0 ? 0 : x - 1; u < columns_ && u <= x + 1; ++u)
        if (!std::isfinite(heights_[v * columns_ + u])) return false;
    return true;
  }

  std::size_t columns_, rows_;
  const T* heights_;
  std::vector<std::uint8_t> flags_;  ///< 1 for samples in a triangle
  tin::CheckWindow<T> window_;
  tin::CheckScan<T> scan_;
  tin::CheckSums sums_;
  GridTinCheck check_;
};

void check_input(std::span<const Point3> points,
                 std::span<const std::array<std::uint32_t, 3>> triangles, double columns,
                 double rows) {
  constexpr double kFar = 0x1p20;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& [x, y, z] = points[i];
    if (!(x >= -kFar && x <= columns + kFar && y >= -kFar && y <= rows + kFar && std::isfinite(z)))
      throw std::invalid_argument("check_grid_tin: point " + std::to_string(i) +
                                  " is not finite or far from the window");
  }
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (const std::uint32_t corner : triangles[i])
      if (corner >= points.size())
        throw std::invalid_argument("check_grid_tin: triangle " + std::to_string(i) +
                                    " has a corner that is not a point");
}

}  // namespace

namespace tin {

template <class T>
GridTinCheck check_grid_tin_with(const GridWindow<T>& window, std::span<const Point3> points,
                                 std::span<const std::array<std::uint32_t, 3>> triangles,
                                 double tolerance, base::SimdPath set,
                                 const base::StopCheck& check_stop) {
  check_shape(window, "check_grid_tin");
  if (!(tolerance >= 0 && tolerance <= 1))
    throw std::invalid_argument("check_grid_tin: tolerance must be in [0, 1]");
  check_input(points, triangles, window.columns, window.rows);
  Checker<T> checker(window, tolerance, set);
  bool first_left = false;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (check_stop) check_stop();
    const auto& [a, b, c] = triangles[i];
    const double area = checker.visit(points[a], points[b], points[c]);
    if (i == 0) first_left = area > 0;
    if (area == 0 || (area > 0) != first_left) checker.count_inverted();
  }
  return checker.finish();
}

template GridTinCheck check_grid_tin_with(const GridWindow<float>&, std::span<const Point3>,
                                          std::span<const std::array<std::uint32_t, 3>>, double,
                                          base::SimdPath, const base::StopCheck&);
template GridTinCheck check_grid_tin_with(const GridWindow<double>&, std::span<const Point3>,
                                          std::span<const std::array<std::uint32_t, 3>>, double,
                                          base::SimdPath, const base::StopCheck&);

}  // namespace tin

template <class T>
GridTinCheck check_grid_tin(const GridWindow<T>& window, std::span<const Point3> points,
                            std::span<const std::array<std::uint32_t, 3>> triangles,
                            double tolerance, const base::StopCheck& check_stop) {
  return tin::check_grid_tin_with(window, points, triangles, tolerance, base::best_simd_path(),
                                  check_stop);
}

template GridTinCheck check_grid_tin(const GridWindow<float>&, std::span<const Point3>,
                                     std::span<const std::array<std::uint32_t, 3>>, double,
                                     const base::StopCheck&);
template GridTinCheck check_grid_tin(const GridWindow<double>&, std::span<const Point3>,
                                     std::span<const std::array<std::uint32_t, 3>>, double,
                                     const base::StopCheck&);

}  // namespace terrace::tri
