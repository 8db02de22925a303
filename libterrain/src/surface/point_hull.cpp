// SPDX-License-Identifier: Apache-2.0
#include "surface/point_hull.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <terrace/stream/store_query.hpp>
#include <terrace/tri/predicates.hpp>

#include "base/streaming_hull.hpp"

namespace terrace::terrain {

PointHull::PointHull(const stream::Store& store, const WantedClusters& wanted) {
  stream::StoreQuery query(store);
  StreamingHull hull;
  std::uint64_t added = 0, compacted_size = 0;
  query.descend(
      wanted.finest(),
      [&](unsigned at, const stream::StoreQuery::Branch& branch) {
        if (!wanted(at, branch.box)) return false;
        // Rebuild the hull whenever a quarter more points have arrived.
        if (added > compacted_size + compacted_size / 4) {
          set_corners(hull.corners());
          compacted_size = added;
        }
        if (is_flat()) return true;
        for (unsigned corner = 0; corner < 4; ++corner) {
          const Point2 p{(corner & 1 ? branch.box.max : branch.box.min)[0],
                         (corner & 2 ? branch.box.max : branch.box.min)[1]};
          if (find(p).side == Side::outside) return true;
        }
        return false;
      },
      [&](const stream::StoreQuery::Node& node) {
        for (const stream::Point3& p : node.positions) hull.add({p[0], p[1]});
        added += node.positions.size();
      });
  set_corners(hull.corners());
}

void PointHull::set_corners(std::vector<Point2> corners) {
  corners_ = std::move(corners);
  greatest_ = static_cast<std::size_t>(std::max_element(corners_.begin(), corners_.end()) -
                                       corners_.begin());
}

PointHull::Found PointHull::find(const Point2& place) const {
  if (place < corners_.front() || corners_[greatest_] < place) return {};
  const auto begin = corners_.begin();
  const auto middle = begin + static_cast<std::ptrdiff_t>(greatest_);
  Found found{Side::inside};
  // Whether the place is not outside the edge that ends at corner `next`.
  const auto look_at = [&](std::size_t next) {
    const std::size_t count = corners_.size();
    const int side = tri::orientation(corners_[(next + count - 1) % count], corners_[next], place);
    if (side == 0) found = {Side::border, next};
    return side >= 0;
  };
  // The lower chain from the least corner to the greatest, then the upper chain back.
  if (place != *middle) {
    const auto after = std::upper_bound(begin, middle + 1, place);
    if (!look_at(static_cast<std::size_t>(after - begin))) return {};
  }
  if (place != *begin && found.side == Side::inside) {
    const auto after = std::upper_bound(middle, corners_.end(), place,
                                        [](const Point2& a, const Point2& b) { return b < a; });
    if (!look_at(after == corners_.end() ? 0 : static_cast<std::size_t>(after - begin))) return {};
  }
  return found;
}

double PointHull::distance(const Point2& place) const {
  if (!is_flat() && find(place).side != Side::outside) return 0.0;
  double least = HUGE_VAL;  // squared
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const Point2 &a = corners_[i], &b = corners_[(i + 1) % corners_.size()];
    const Point2 side{b[0] - a[0], b[1] - a[1]}, off{place[0] - a[0], place[1] - a[1]};
    const double squared = side[0] * side[0] + side[1] * side[1];
    const double along =
        squared > 0.0 ? std::clamp((off[0] * side[0] + off[1] * side[1]) / squared, 0.0, 1.0) : 0.0;
    const double dx = off[0] - along * side[0], dy = off[1] - along * side[1];
    least = std::min(least, dx * dx + dy * dy);
  }
  return std::sqrt(least);
}

}  // namespace terrace::terrain
