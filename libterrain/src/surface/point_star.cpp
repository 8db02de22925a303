// SPDX-License-Identifier: Apache-2.0
#include "surface/point_star.hpp"

#include <algorithm>

#include <terrace/tri/predicates.hpp>

namespace terrace::terrain {
namespace {

/// Whether b, which is collinear with a and c, is strictly between them.
bool lies_between(const Point2& a, const Point2& b, const Point2& c) {
  return (a < b && b < c) || (c < b && b < a);
}

}  // namespace

void PointStar::start(const Point2& centre) {
  centre_ = centre;
  has_centre_ = false;
  spokes_.clear();
  on_line_.clear();
}

/// Whether the direction to a point is less than half a turn left of that to the first neighbour.
bool PointStar::is_early(const Point2& point) const {
  const Point2& first = spokes_.front().end;
  if (point == first) return true;
  const int side = tri::orientation(centre_, first, point);
  return side > 0 || (side == 0 && (point < centre_) == (first < centre_));
}

/// Returns the last neighbour not left of the direction to a point, counted from the first one.
std::size_t PointStar::spoke_before(const Point2& point) const {
  const bool is_point_early = is_early(point);
  std::size_t before = 0, after = size();
  while (after - before > 1) {
    const std::size_t middle = before + (after - before) / 2;
    const Point2& end = spokes_[middle].end;
    if (end == point) return middle;
    const bool is_before = is_early(end) == is_point_early
                               ? tri::orientation(centre_, end, point) >= 0
                               : !is_point_early;
    (is_before ? before : after) = middle;
  }
  return before;
}

/// A sector is between the spoke with its number and the next one.
bool PointStar::is_in_conflict(std::size_t sector, const Point2& point) const {
  const std::size_t next = sector + 1 < spokes_.size() ? sector + 1 : 0;
  const Spoke &a = spokes_[sector], &b = spokes_[next];
  if (!a.is_outside && !b.is_outside) return tri::inside_circle(centre_, a.end, b.end, point);
  // Tests beyond an edge of the hull, or between its ends.
  const Point2& end = a.is_outside ? b.end : a.end;
  const int side = tri::orientation(centre_, end, point);
  return (a.is_outside ? side < 0 : side > 0) || (side == 0 && lies_between(centre_, point, end));
}

void PointStar::offer(const Point2& point) {
  if (point == centre_) {
    has_centre_ = true;
    return;
  }
  if (spokes_.empty()) return spokes_.push_back({point});
  if (spokes_.size() == 1) {
    const int side = tri::orientation(centre_, spokes_[0].end, point);
    if (side == 0) return on_line_.push_back(point);
    spokes_.insert(side > 0 ? spokes_.end() : spokes_.begin(), {point});
    spokes_.push_back({.is_outside = true});
    for (const Point2& p : on_line_) offer(p);
    return on_line_.clear();
  }
  // If there is a conflict, there is one in the sector towards the point. Beyond the last neighbour
  // of an open star that is one of two sectors.
  const std::size_t all = spokes_.size();
  std::size_t first = spoke_before(point);
  if (spokes_[first].end == point) return;
  if (!is_in_conflict(first, point)) {
    if (!spokes_[++first % all].is_outside || !is_in_conflict(first, point)) return;
  }
  std::size_t last = first;
  for (std::size_t next = (last + 1) % all; next != first && is_in_conflict(next, point);) {
    last = next;
    next = (next + 1) % all;
  }
  for (std::size_t next = (first + all - 1) % all; next != last && is_in_conflict(next, point);) {
    first = next;
    next = (next + all - 1) % all;
  }
  replace(first, last, point);
}

/// Replaces the spokes between these sectors by the point.
void PointStar::replace(std::size_t first, std::size_t last, const Point2& point) {
  const std::size_t all = spokes_.size(), begin = (first + 1) % all;
  const std::size_t removed = (last + all - first) % all;
  const auto at = [&](std::size_t i) { return spokes_.begin() + static_cast<std::ptrdiff_t>(i); };
  spokes_[first].mark = 0;
  if (removed == 0) {
    spokes_.insert(at(begin), {point});
    return;
  }
  spokes_[begin] = {point};
  spokes_.erase(at(begin + 1), at(std::min(begin + removed, all)));
  if (begin + removed > all) spokes_.erase(at(0), at(begin + removed - all));
}

}  // namespace terrace::terrain
