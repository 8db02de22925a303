// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/point_mesh_scan.hpp"

#include <cmath>
#include <string>

#include <terrace/stream/error.hpp>

#include "base/streaming_hull.hpp"
#include "terrace/terrain/detail.hpp"

namespace terrace::terrain {
namespace {

constexpr std::size_t kMostPlaces = std::size_t{1} << 20;
/// As tri::point_tin() takes them; products of two still are numbers.
constexpr double kLargest = 1e100;

/// Every other one goes.
void thin_out(std::vector<Point2>& places) {
  for (std::size_t i = 0; 2 * i < places.size(); ++i) places[i] = places[2 * i];
  places.resize((places.size() + 1) / 2);
}

}  // namespace

PointMeshScan scan_point_mesh(const stream::Store& store, const Detail& detail, std::size_t few) {
  PointMeshScan scan;
  scan.whole.emplace();
  StreamingHull hull;
  const auto add = [&](const stream::Point3& p) {
    if (!(std::abs(p[0]) < kLargest && std::abs(p[1]) < kLargest && std::abs(p[2]) < kLargest)) {
      throw stream::Error({.file = store.path().string(),
                           .where = {},
                           .cause = "a point has a coordinate that is not finite or above 1e100",
                           .remedy = "leave it out of the store, or of the `region`"});
    }
    if (scan.samples % scan.period == 0) {
      if (scan.some.size() == kMostPlaces) {
        thin_out(scan.some);
        scan.period *= 2;
      }
      if (scan.samples % scan.period == 0) scan.some.push_back({p[0], p[1]});
    }
    ++scan.samples;
    hull.add({p[0], p[1]});
    if (!scan.whole) return;
    if (scan.samples > few) {
      scan.whole.reset();
    } else {
      scan.whole->add(p);
    }
  };
  for_each_wanted_point(store, detail,
                        [&](stream::ClusterId, const stream::ClusterPoints&, std::size_t,
                            const stream::Point3& p) { add(p); });
  if (scan.whole) {
    scan.some = {};
  } else {
    scan.hull = hull.corners();
  }
  return scan;
}

}  // namespace terrace::terrain
