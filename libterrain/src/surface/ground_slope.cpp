// SPDX-License-Identifier: Apache-2.0
#include "surface/ground_slope.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <deque>
#include <mutex>
#include <vector>

namespace terrace::terrain {

struct GroundSlope::Table {
  static constexpr std::size_t kSide = 256;

  stream::Box3 bounds;
  std::mutex mutex;  ///< protects the creation of maps
  std::vector<std::atomic<const GroundMap*>> maps;
  std::deque<GroundMap> storage;

  explicit Table(const stream::Box3& box) : bounds(box), maps(kSide * kSide) {}

  GroundMap at(const Ground& ground, const Point2& stored) {
    std::array<std::size_t, 2> part{};
    stream::Box3 box;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double width = (bounds.max[axis] - bounds.min[axis]) / kSide;
      if (width > 0) {
        part[axis] = static_cast<std::size_t>(
            std::clamp((stored[axis] - bounds.min[axis]) / width, 0.0, kSide - 1.0));
      }
      box.min[axis] = box.max[axis] =
          bounds.min[axis] + width * (static_cast<double>(part[axis]) + 0.5);
    }
    box.min[2] = box.max[2] = 0;
    std::atomic<const GroundMap*>& slot = maps[part[1] * kSide + part[0]];
    if (const GroundMap* map = slot.load(std::memory_order_acquire)) return *map;
    const std::lock_guard lock(mutex);
    if (slot.load() == nullptr) slot = &storage.emplace_back(ground.map(box));
    return *slot.load();
  }
};

GroundSlope::GroundSlope(const stream::Store& store)
    : placement_(store.schema()),
      ground_(placement_),
      turns_(placement_, store.bounds()),
      grid_(store.schema().grid) {
  if (ground_.same_everywhere()) map_ = ground_.map({});
  if (ground_.projected()) table_ = std::make_shared<Table>(store.bounds());
}

GroundMap GroundSlope::map_at(const Point2& stored) const {
  if (ground_.same_everywhere()) return map_;
  if (table_ != nullptr) return table_->at(ground_, stored);
  const stream::Point3 p{stored[0], stored[1], 0};
  return ground_.map({p, p});
}

Point2 GroundSlope::stored(const Point2& world) const {
  Point2 place = stored_place(placement_, turns_(world));
  if (grid_) {
    for (double& c : place) {
      const double rounded = std::nearbyint(c);
      if (std::abs(c - rounded) <= 1e-6) c = rounded;
    }
  }
  return place;
}

Point2 GroundSlope::world(const Point2& stored) const {
  const stream::Point3 p = world_point(placement_, {stored[0], stored[1], 0});
  return {p[0], p[1]};
}

double GroundSlope::metres(const Point2& a, const Point2& b) const {
  const double dx = b[0] - a[0], dy = b[1] - a[1];
  const GroundMap m = map_at({a[0] + 0.5 * dx, a[1] + 0.5 * dy});
  const double east = m[0] * dx + m[1] * dy, north = m[3] * dx + m[4] * dy;
  return std::sqrt(east * east + north * north);
}

tri::Gradient GroundSlope::on_ground(const Point2& stored, const SurfacePoint& surface) const {
  if (!(surface.per_column == surface.per_column)) return {};
  const GroundMap m = map_at(stored);
  // ground = A * stored, so the gradient is transformed by the inverse of A's transpose.
  const double metres = m[8] / placement_.coordinates[2].scale;
  const double factor = metres / (m[0] * m[4] - m[1] * m[3]);
  return {(m[4] * surface.per_column - m[3] * surface.per_row) * factor,
          (m[0] * surface.per_row - m[1] * surface.per_column) * factor};
}

std::function<bool(const Point2&, const Point2&)> longer_than(const stream::Store& store,
                                                              double metres) {
  return [ground = GroundSlope(store), metres](const Point2& a, const Point2& b) {
    return ground.metres(a, b) > metres;
  };
}

}  // namespace terrace::terrain
