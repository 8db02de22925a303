// SPDX-License-Identifier: Apache-2.0
#include "surface/wanted_clusters.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <terrace/stream/store_query.hpp>

#include "base/store_checks.hpp"
#include "surface/store_window.hpp"

namespace terrace::terrain {

struct WantedClusters::Focuses {
  stream::Placement placement;
  Detail detail;
  double low = 0, high = 0;  ///< stored heights of the store
  Point2 last{};             ///< last column and row of a raster
  double points = 0;         ///< approximate number, with the points outside the focuses
};

namespace {

/// Returns the box in stored coordinates around a region, with all heights.
stream::Box3 stored_box_around(const stream::Placement& placement, const Region& region) {
  const stream::Box3& world = region.box();
  stream::Box3 stored;
  for (unsigned corner = 0; corner < 4; ++corner) {
    const Point2 p = stored_place(placement, {(corner & 1 ? world.max : world.min)[0],
                                              (corner & 2 ? world.max : world.min)[1]});
    stored.include(tall({p, p}));
  }
  return stored;
}

}  // namespace

WantedClusters::WantedClusters(const stream::Store& store, unsigned level,
                               std::span<const FinerRegion> focuses)
    : level_(level), finest_(level) {
  need_level(store, level);
  for (const FinerRegion& focus : focuses) need_level(store, focus.level);
  if (store.points() == 0) return;
  const stream::Store whole = store.whole();
  Focuses found{.placement = store.schema(), .detail = {.level = level}};
  found.points = static_cast<double>(store.levels()[level].points);
  stream::StoreQuery query(whole);
  for (const FinerRegion& focus : focuses) {
    if (focus.level >= level) continue;
    found.detail.focuses.push_back(focus);
    const double share = static_cast<double>(store.levels()[focus.level].points) /
                         static_cast<double>(store.points());
    found.points += share * query.estimate(stored_box_around(found.placement, focus.region));
  }
  if (found.detail.focuses.empty()) return;
  found.detail = with_margin(store, found.detail);
  found.low = whole.bounds().min[2];
  found.high = whole.bounds().max[2];
  if (store.schema().grid) {
    found.last = {static_cast<double>(store.schema().columns) - 1,
                  static_cast<double>(store.schema().rows) - 1};
  }
  finest_ = found.detail.finest();
  focuses_ = std::make_shared<const Focuses>(std::move(found));
}

unsigned WantedClusters::finest_at(const Point2& stored) const {
  unsigned finest = level_;
  if (!is_mixed()) return finest;
  const stream::Point3 world = world_point(focuses_->placement, {stored[0], stored[1], 0});
  for (const FinerRegion& focus : focuses_->detail.focuses) {
    if (focus.level < finest && focus.region.covers({world[0], world[1]})) finest = focus.level;
  }
  return finest;
}

bool WantedClusters::in_focus(unsigned cluster_level, const stream::Box3& box) const {
  return focuses_->detail.wants(cluster_level, world_box(focuses_->placement, box));
}

double WantedClusters::points(const stream::Store& store) const {
  return is_mixed() ? focuses_->points : static_cast<double>(store.levels()[level_].points);
}

bool WantedClusters::has_all_samples(const Point2& stored, double cells) const {
  if (!is_mixed() || finest_ > 0) return false;
  if (!std::isfinite(stored[0]) || !std::isfinite(stored[1])) return false;
  stream::Box3 around{{0, 0, focuses_->low}, {0, 0, focuses_->high}};
  for (std::size_t k = 0; k < 2; ++k) {
    around.min[k] = std::clamp(stored[k] - cells, 0.0, focuses_->last[k]);
    around.max[k] = std::clamp(stored[k] + cells, 0.0, focuses_->last[k]);
  }
  around = world_box(focuses_->placement, around);
  return std::any_of(focuses_->detail.focuses.begin(), focuses_->detail.focuses.end(),
                     [&](const FinerRegion& focus) {
                       return focus.level == 0 && focus.region.overlap(around) == Overlap::whole;
                     });
}

}  // namespace terrace::terrain
