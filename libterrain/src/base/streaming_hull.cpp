// SPDX-License-Identifier: Apache-2.0
#include "base/streaming_hull.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <terrace/tri/predicates.hpp>

namespace terrace::terrain {
namespace {

constexpr std::size_t kMinWaiting = 4096;

/// Returns the other coordinate at which a side from `from` to `to` (counter-clockwise, so that the
/// inside is on its left) has the coordinate c along `axis`; on the side or to its right.
double outward_place(const Point2& from, const Point2& to, unsigned axis, double c) {
  const unsigned along = 1 - axis;
  if (from[along] == to[along]) return from[along];
  const double part = (c - from[axis]) / (to[axis] - from[axis]);
  double at = from[along] + (to[along] - from[along]) * part;
  const auto left = [&](double t) {
    return tri::orientation(from, to, axis == 0 ? Point2{c, t} : Point2{t, c}) > 0;
  };
  // The right of a side is towards smaller y if the side goes to larger x, and towards larger x if
  // it goes to larger y.
  const bool grows = (to[axis] > from[axis]) == (axis == 1);
  const double size = std::max(std::abs(from[along]), std::abs(to[along]));
  for (double step = std::max(size * 0x1p-53, 0x1p-1060); left(at); step *= 2.0)
    at += grows ? step : -step;
  return at;
}

}  // namespace

std::vector<Point2> convex_hull(std::vector<Point2> points, bool keep_straight) {
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  const int least = keep_straight ? 0 : 1;
  std::vector<Point2> hull;
  const auto add = [&](const Point2& p, std::size_t base) {
    while (hull.size() >= base + 2 &&
           tri::orientation(hull[hull.size() - 2], hull.back(), p) < least) {
      hull.pop_back();
    }
    hull.push_back(p);
  };
  for (const Point2& p : points) add(p, 0);
  // If all points are on one line, there is no upper chain.
  if (hull.size() == points.size() && tri::orientation(points[0], points[1], points.back()) == 0 &&
      std::all_of(points.begin(), points.end(), [&](const Point2& p) {
        return tri::orientation(points.front(), points.back(), p) == 0;
      })) {
    return {points.front(), points.back()};
  }
  const std::size_t base = hull.size() - 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], base);
  hull.pop_back();
  return hull;
}

std::optional<std::array<double, 2>> crossings(std::span<const Point2> hull, unsigned axis,
                                               double c) {
  std::optional<std::array<double, 2>> found;
  const auto take = [&](double at) {
    if (!found) found = {at, at};
    (*found)[0] = std::min((*found)[0], at);
    (*found)[1] = std::max((*found)[1], at);
  };
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Point2& from = hull[i];
    const Point2& to = hull[i + 1 == hull.size() ? 0 : i + 1];
    if (from[axis] == c) take(from[1 - axis]);
    if ((from[axis] < c && c < to[axis]) || (to[axis] < c && c < from[axis])) {
      take(outward_place(from, to, axis, c));
    }
  }
  return found;
}

bool StreamingHull::inside(const Point2& point) const {
  if (hull_.size() < 3) return false;
  const Point2& least = hull_.front();
  const Point2& greatest = hull_[upper_];
  if (point < least || greatest < point) return false;
  // The lower chain goes from the least corner to the greatest, the upper one back again.
  const bool below = tri::orientation(least, greatest, point) < 0;
  const auto begin = hull_.begin(), middle = begin + static_cast<std::ptrdiff_t>(upper_);
  if (below) {
    const auto to = std::upper_bound(begin + 1, middle, point);
    return tri::orientation(*(to - 1), *to, point) >= 0;
  }
  const auto from =
      std::upper_bound(middle + 1, hull_.end(), point, [](const Point2& a, const Point2& b) {
        return b < a;  // the chain descends
      });
  return tri::orientation(*(from - 1), from == hull_.end() ? least : *from, point) >= 0;
}

void StreamingHull::keep(const Point2& point) {
  waiting_.push_back(point);
  if (waiting_.size() < std::max(kMinWaiting, hull_.size())) return;
  hull_ = corners();
  waiting_.clear();
  if (hull_.size() < 3) return;
  upper_ = static_cast<std::size_t>(std::max_element(hull_.begin(), hull_.end()) - hull_.begin());
  // A box between the extremes along the four diagonals, one in each quadrant.
  std::array<Point2, 4> extreme;
  extreme.fill(hull_.front());
  const auto reach = [](const Point2& p, std::size_t d) {
    return ((d & 1) != 0 ? p[0] : -p[0]) + ((d & 2) != 0 ? p[1] : -p[1]);
  };
  for (const Point2& p : hull_) {
    for (std::size_t d = 0; d < 4; ++d) {
      if (reach(p, d) > reach(extreme[d], d)) extreme[d] = p;
    }
  }
  low_ = {std::max(extreme[0][0], extreme[2][0]), std::max(extreme[0][1], extreme[1][1])};
  high_ = {std::min(extreme[1][0], extreme[3][0]), std::min(extreme[2][1], extreme[3][1])};
}

std::vector<Point2> StreamingHull::corners() const {
  std::vector<Point2> all = hull_;
  all.insert(all.end(), waiting_.begin(), waiting_.end());
  return convex_hull(std::move(all));
}

}  // namespace terrace::terrain
