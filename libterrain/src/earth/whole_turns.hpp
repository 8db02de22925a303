// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <terrace/stream/schema.hpp>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Shifts longitudes (and x of Web Mercator) by whole turns to the data: across the antimeridian,
/// or when counted from 0 to 360, one place has two longitudes.
class WholeTurns {
 public:
  WholeTurns() = default;
  /// Shifts to within half a turn of the middle; if that is NaN, shifts nothing.
  WholeTurns(double middle, double turn) : turn_(turn), middle_(middle), reach_(0.5 * turn) {}
  /// stored: the store's bounds.
  WholeTurns(const stream::Placement& placement, const stream::Box3& stored) {
    const stream::Crs& crs = placement.crs;
    const bool degrees = crs.geographic && crs.horizontal_unit == "degree";
    if (!(degrees || crs.epsg == kWebMercator) || stored.empty()) return;
    const stream::Box3 box = world_box(placement, stored);
    const double turn = degrees ? 360 : kWebMercatorWidth;
    // Wider data are not on the earth.
    if (box.max[0] - box.min[0] <= turn) *this = {0.5 * (box.min[0] + box.max[0]), turn};
  }

  /// 0 if longitudes are not shifted.
  [[nodiscard]] double turn() const { return turn_; }
  [[nodiscard]] Point2 operator()(Point2 place) const {
    const double off = middle_ - place[0];
    if (turn_ > 0 && std::abs(off) > reach_) place[0] += turn_ * std::round(off / turn_);
    return place;
  }

 private:
  static constexpr int kWebMercator = 3857;
  static constexpr double kWebMercatorWidth = 2 * 20037508.342789244;

  double turn_ = 0, middle_ = 0, reach_ = 0;
};

}  // namespace terrace::terrain
