// SPDX-License-Identifier: GPL-3.0-or-later
#include "terrace/tri/grid_tin_check.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "check_window.hpp"

namespace terrace::tri {
namespace {

// Bits for a sample.
constexpr std::uint8_t kCovered = 1;

template <class T>
class Checker {
 public:
  Checker(const GridWindow<T>& window, double tolerance)
      : window_(window), tolerance_(tolerance), flags_(window.heights.size(), 0) {}

  /// Returns twice the area, as the points are given.
  double visit(Point3 a, Point3 b, Point3 c) {
    const double area = turn(a, b, c);
    if (area == 0) return area;
    if (area < 0) std::swap(b, c);
    const double size = std::fabs(area);
    const Point3* const corner[4] = {&a, &b, &c, &a};
    double margin[3] = {0, 0, 0};
    if (tolerance_ > 0)
      for (int i = 0; i < 3; ++i)
        margin[i] = tolerance_ * std::hypot((*corner[i + 1])[0] - (*corner[i])[0],
                                            (*corner[i + 1])[1] - (*corner[i])[1]);
    const double bz = b[2] - a[2], cz = c[2] - a[2];
    const double slope_x = (bz * (c[1] - a[1]) - cz * (b[1] - a[1])) / size;
    const double slope_y = (cz * (b[0] - a[0]) - bz * (c[0] - a[0])) / size;
    const double last_column = window_.columns - 1.0, last_row = window_.rows - 1.0;
    const double left = std::max(0.0, std::min({a[0], b[0], c[0]}) - tolerance_);
    const double right = std::min(last_column, std::max({a[0], b[0], c[0]}) + tolerance_);
    const double top = std::max(0.0, std::ceil(std::min({a[1], b[1], c[1]}) - tolerance_));
    const double bottom = std::min(last_row, std::max({a[1], b[1], c[1]}) + tolerance_);
    for (double y = top; y <= bottom; ++y) {
      double from = left, to = right;
      for (int i = 0; i < 3; ++i) {
        const Point3 &p = *corner[i], &q = *corner[i + 1];
        // Inside: along_x (x - p.x) + rest >= 0.
        const double along_x = p[1] - q[1];
        const double rest = (q[0] - p[0]) * (y - p[1]) + margin[i];
        if (along_x > 0) {
          from = std::max(from, p[0] - rest / along_x);
        } else if (along_x < 0) {
          to = std::min(to, p[0] - rest / along_x);
        } else if (rest < 0) {
          to = -1;
        }
      }
      if (!(from <= to)) continue;
      const auto first = static_cast<std::size_t>(std::ceil(from));
      const auto last = static_cast<std::size_t>(to);  // rounded down
      const std::size_t row = static_cast<std::size_t>(y) * window_.columns;
      const double rise_y = slope_y * (y - a[1]);
      for (std::size_t x = first; x <= last; ++x) {
        const auto column = static_cast<double>(x);
        const auto height = static_cast<double>(window_.heights[row + x]);
        // Relative to a corner, so that nothing is lost where heights are large.
        const double error = std::fabs((height - a[2]) - (rise_y + slope_x * (column - a[0])));
        std::uint8_t& flags = flags_[row + x];
        if (error <= most_ && (flags & kCovered) != 0) continue;
        if (!std::isfinite(height)) {
          if ((flags & kCovered) == 0 && inside(a, b, c, column, y)) {
            flags = kCovered;
            ++check_.nodata_covered;
          }
          continue;
        }
        most_ = std::max(most_, error);
        if ((flags & kCovered) != 0) continue;
        flags = kCovered;
        ++check_.covered;
        squares_ += error * error;
      }
    }
    return area;
  }

  GridTinCheck finish() {
    const std::size_t columns = window_.columns, rows = window_.rows;
    for (std::size_t i = 0; i < flags_.size(); ++i) {
      if (!std::isfinite(window_.heights[i])) continue;
      ++check_.samples;
      if (flags_[i] == 0) check_.uncovered_inner += inner(i % columns, i / columns, rows) ? 1 : 0;
    }
    check_.uncovered = check_.samples - check_.covered;
    check_.max_error = most_;
    if (check_.covered > 0)
      check_.rms_error = std::sqrt(squares_ / static_cast<double>(check_.covered));
    return check_;
  }

  void count_turned() { ++check_.turned; }

 private:
  static double turn(const Point3& a, const Point3& b, const Point3& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  }

  static bool inside(const Point3& a, const Point3& b, const Point3& c, double x, double y) {
    const Point3 p{x, y, 0};
    return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
  }

  bool inner(std::size_t x, std::size_t y, std::size_t rows) const {
    for (std::size_t v = y == 0 ? 0 : y - 1; v < rows && v <= y + 1; ++v)
      for (std::size_t u = x == 0 ? 0 : x - 1; u < window_.columns && u <= x + 1; ++u)
        if (!std::isfinite(window_.heights[v * window_.columns + u])) return false;
    return true;
  }

  const GridWindow<T>& window_;
  double tolerance_;
  std::vector<std::uint8_t> flags_;
  GridTinCheck check_;
  double most_ = 0, squares_ = 0;
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

template <class T>
GridTinCheck check_grid_tin(const GridWindow<T>& window, std::span<const Point3> points,
                            std::span<const std::array<std::uint32_t, 3>> triangles,
                            double tolerance) {
  tin::check_shape(window, "check_grid_tin");
  if (!(tolerance >= 0 && tolerance <= 1))
    throw std::invalid_argument("check_grid_tin: tolerance must be in [0, 1]");
  check_input(points, triangles, window.columns, window.rows);
  Checker<T> checker(window, tolerance);
  bool first_left = false;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& [a, b, c] = triangles[i];
    const double area = checker.visit(points[a], points[b], points[c]);
    if (i == 0) first_left = area > 0;
    if (area == 0 || (area > 0) != first_left) checker.count_turned();
  }
  return checker.finish();
}

template GridTinCheck check_grid_tin(const GridWindow<float>&, std::span<const Point3>,
                                     std::span<const std::array<std::uint32_t, 3>>, double);
template GridTinCheck check_grid_tin(const GridWindow<double>&, std::span<const Point3>,
                                     std::span<const std::array<std::uint32_t, 3>>, double);

}  // namespace terrace::tri
