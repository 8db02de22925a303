// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <terrace/stream/store.hpp>

#include "surface/point_hull.hpp"
#include "surface/point_voids.hpp"

namespace terrace::terrain {

/// A store's points of a level and above, with what is known about their triangulation as a whole.
/// The windows and surfaces of all threads share one object.
struct PointCloud {
  /// Finds the hull. The store must outlive this object. Throws: stream::Error on a damaged store,
  /// stream::Stopped.
  PointCloud(const stream::Store& cloud, unsigned least_level)
      : store(cloud), level(least_level), hull(cloud, least_level), voids(cloud, least_level) {}

  const stream::Store& store;
  unsigned level;
  PointHull hull;
  PointVoids voids;
};

}  // namespace terrace::terrain
