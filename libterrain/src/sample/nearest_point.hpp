// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The nearest point in x,y of a level and above of a store, exactly, in stored coordinates. Looks
/// only into clusters whose boxes are nearer than the nearest point so far, the nearest first. Some
/// microseconds a place where the next place is near; one object per thread.
class NearestPoint {
 public:
  /// cache_bytes: decoded clusters to keep. The store must outlive this.
  NearestPoint(const stream::Store& store, unsigned level, std::uint64_t cache_bytes);

  /// The nearest point; of several equally near, the lexicographically smallest. Requires a finite
  /// place; NaN if there are no points. Throws: stream::Error on a damaged store.
  Point2 operator()(const Point2& place);

 private:
  void add(const Point2& point, const Point2& place);

  stream::StoreQuery query_;
  unsigned level_;
  std::vector<Point2> nearest_;  ///< as near as rounding can tell, and maybe farther ones before
  std::optional<Point2> last_;
  double bound_ = 0;  ///< the square of the distance of the nearest, or a little more
};

}  // namespace terrace::terrain
