// SPDX-License-Identifier: GPL-3.0-or-later
#include "point_mesh_reader.hpp"

#include <algorithm>
#include <cmath>

namespace terrace::tools {

PointMeshReader::PointMeshReader(const stream::Store& store, const std::optional<Region>& region)
    : region_(region),
      placement_(placement_of(store.schema())),
      bounds_(world_box(placement_, store.bounds())),
      window_(store) {}

void PointMeshReader::read(const PlaneBox& box, MeshSamples& out) {
  out = {};
  Point2 low{}, high{};
  for (std::size_t k = 0; k < 2; ++k) {
    low[k] = std::max(box.min[k], bounds_.min[k]);
    high[k] = std::min(box.max[k], bounds_.max[k]);
    if (!(low[k] <= high[k])) return;
    // The way to stored coordinates and back rounds.
    const double margin = std::max(std::abs(low[k]), std::abs(high[k])) * 0x1p-48;
    low[k] -= margin;
    high[k] += margin;
  }
  StoredBox stored;
  for (unsigned corner = 0; corner < 4; ++corner) {
    const Point2 p = stored_place(
        placement_, {(corner & 1) != 0 ? high[0] : low[0], (corner & 2) != 0 ? high[1] : low[1]});
    for (std::size_t k = 0; k < 2; ++k) {
      const double margin = std::abs(p[k]) * 0x1p-40;
      stored.min[k] = corner == 0 ? p[k] - margin : std::min(stored.min[k], p[k] - margin);
      stored.max[k] = corner == 0 ? p[k] + margin : std::max(stored.max[k], p[k] + margin);
    }
  }
  WindowPoints points;
  window_.points(stored, points);
  for (const stream::Point3& position : points.positions) {
    const stream::Point3 p = world_point(placement_, position);
    if (box.contains({p[0], p[1]}) && (!region_ || region_->contains(p))) out.add(p);
  }
}

double merged_height(std::span<const double> heights, tri::PointDuplicates duplicates) {
  double height = heights.front();
  if (duplicates == tri::PointDuplicates::kMin) {
    height = *std::min_element(heights.begin(), heights.end());
  } else if (duplicates == tri::PointDuplicates::kMax) {
    height = *std::max_element(heights.begin(), heights.end());
  } else if (duplicates == tri::PointDuplicates::kMean) {
    double sum = 0.0;
    for (const double other : heights) sum += other - heights.front();
    height += sum / static_cast<double>(heights.size());
  }
  return height;
}

}  // namespace terrace::tools
