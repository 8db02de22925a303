// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include <terrace/stream/schema.hpp>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Places asked for in a geographic store, moved by whole turns to where it lies: across the
/// antimeridian, or with longitudes from 0 to 360, one place has two longitudes.
class WholeTurns {
 public:
  WholeTurns() = default;
  /// stored: the store's bounds.
  WholeTurns(const stream::Placement& placement, const stream::Box3& stored) {
    const stream::Crs& crs = placement.crs;
    if (!crs.geographic || crs.horizontal_unit != "degree" || stored.empty()) return;
    const stream::Box3 box = world_box(placement, stored);
    middle_ = 0.5 * (box.min[0] + box.max[0]);
    reach_ = std::max(0.5 * kTurn, box.max[0] - middle_);
  }

  /// 0 where longitudes have no turns.
  [[nodiscard]] double turn() const { return reach_ > 0 ? kTurn : 0; }
  [[nodiscard]] Point2 operator()(Point2 place) const {
    const double off = middle_ - place[0];
    if (reach_ > 0 && std::abs(off) > reach_) place[0] += kTurn * std::round(off / kTurn);
    return place;
  }

 private:
  static constexpr double kTurn = 360;

  double middle_ = 0, reach_ = 0;
};

}  // namespace terrace::terrain
