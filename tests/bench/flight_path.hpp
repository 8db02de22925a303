// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include <terrace/stream/store.hpp>
#include <terrace/tri/view.hpp>

#include "terrace/terrain/store_view.hpp"

namespace terrace::tests {

enum class Kind { perspective, map };

/// The camera's path: a circle around the centre, looking ahead and down by 30 degrees. The map
/// view looks straight down.
class Flight {
 public:
  /// active: number of points wanted in the model.
  Flight(const stream::Store& store, Kind kind, std::size_t active)
      : kind_(kind), points_(static_cast<double>(active)) {
    const terrain::StoreView<std::int32_t> view(store);
    const stream::Box3& stored = store.bounds();
    stream::Box3 box;
    box.include(view.in_view_frame(stored.min));
    box.include(view.in_view_frame(stored.max));
    const double side = std::min(box.max[0] - box.min[0], box.max[1] - box.min[1]);
    cell_ = std::sqrt((box.max[0] - box.min[0]) * (box.max[1] - box.min[1]) /
                      static_cast<double>(store.points()));
    radius_ = 0.22 * side;
    const double ground = view.in_view_frame({0, 0, store.mean_height()})[2];
    // The visible ground has about as many cells as points are wanted, whatever the store's size.
    const double seen = std::sqrt(points_) * cell_;
    above_ = 0.3 * seen;
    height_ = kind == Kind::perspective ? ground + above_ : box.max[2] + 1.0;
  }

  /// A larger scale gives more points: a larger extent of the map, more detail in perspective.
  double scale = 1.0;

  [[nodiscard]] tri::View view(double way) const {
    const double angle = way / radius_, c = std::cos(angle), s = std::sin(angle);
    tri::Pose pose;
    pose.position = {radius_ * c, radius_ * s, height_};
    tri::View view;
    if (kind_ == Kind::map) {
      view.camera = tri::orthographic_camera(pose, map_height(), kAspect, kPixels);
      view.pixel_error = 1e-6;  // full resolution
      return view;
    }
    pose.direction = {-s * std::sqrt(0.75), c * std::sqrt(0.75), -0.5};
    pose.up = {0, 0, 1};
    view.camera = tri::perspective_camera(pose, kFov, kAspect, kPixels);
    view.pixel_error = 2.0 / scale;
    return view;
  }
  /// Width of the visible ground in metres; in perspective, at the centre of the picture.
  [[nodiscard]] double width() const {
    if (kind_ == Kind::map) return kAspect * map_height();
    return 2.0 * (2.0 * above_) * std::tan(kFov / 2 * std::numbers::pi / 180.0) * kAspect;
  }

 private:
  static constexpr double kAspect = 1.5, kPixels = 1080.0, kFov = 60.0;

  [[nodiscard]] double map_height() const { return scale * std::sqrt(points_ / kAspect) * cell_; }

  Kind kind_;
  double points_;
  double cell_ = 0.0, radius_ = 0.0, above_ = 0.0, height_ = 0.0;
};

}  // namespace terrace::tests
