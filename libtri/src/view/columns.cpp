// SPDX-License-Identifier: Apache-2.0
#include "columns.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace terrace::tri {
namespace {

// Squares and products with normals stay finite below this.
constexpr double kFar = 1e150;
// Errors times pixels stay finite, and demands due to errors stay below forced ones.
constexpr double kMaxDemand = 1e299;
constexpr std::size_t kBlock = 256;

/// Only the first entries are used, one per box.
using Block = std::array<double, kBlock>;

/// By axis, for loops over many boxes.
struct Boxes {
  std::array<const double*, 3> min, max;
  std::size_t count;
};

// The minimum over the planes of the greatest signed distance of a point of the box. Negative only
// if the box is entirely outside one plane.
void depth_inside(const Camera& camera, const Boxes& boxes, Block& depth) {
  std::fill_n(depth.begin(), boxes.count, std::numeric_limits<double>::infinity());
  for (const Plane& plane : camera.planes) {
    std::array<const double*, 3> corner;
    for (std::size_t k = 0; k < 3; ++k) {
      corner[k] = plane.normal[k] >= 0.0 ? boxes.max[k] : boxes.min[k];
    }
    const Point3 n = plane.normal;
    const double offset = plane.offset;
    for (std::size_t i = 0; i < boxes.count; ++i) {
      const double s = n[0] * corner[0][i] + n[1] * corner[1][i] + n[2] * corner[2][i] + offset;
      depth[i] = s < depth[i] ? s : depth[i];
    }
  }
}

// `near`: Euclidean distance to the nearest point. `far`: greatest difference on an axis to the
// farthest point.
void distances(const Point3& eye, const Boxes& boxes, Block& near, Block& far) {
  std::fill_n(near.begin(), boxes.count, 0.0);
  std::fill_n(far.begin(), boxes.count, 0.0);
  for (std::size_t k = 0; k < 3; ++k) {
    const double e = eye[k];
    const double* min = boxes.min[k];
    const double* max = boxes.max[k];
    for (std::size_t i = 0; i < boxes.count; ++i) {
      const double below = min[i] - e, above = e - max[i];
      const double out = std::max(std::max(below, above), 0.0);
      near[i] += out * out;
      far[i] = std::max(far[i], std::max(-below, -above));
    }
  }
  for (std::size_t i = 0; i < boxes.count; ++i) near[i] = std::sqrt(near[i]);
}

// Sets the gain of boxes for which a normal of the cone may be perpendicular to a line of sight to
// a point of the box. The line's direction v then has |axis . v| <= sine |v|, and axis . v is an
// interval over the box.
void outlines(const Camera& camera, const ViewColumns& columns, std::size_t first,
              const Boxes& boxes, double slack, const Block& far, Block& factor, double gain) {
  for (std::size_t i = 0; i < boxes.count; ++i) {
    const double sine = columns.column(ViewColumns::kSine)[first + i] + slack;
    double least = 0.0, greatest = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double a = columns.column(ViewColumns::kAxis + k)[first + i];
      double low = a * camera.direction[k], high = low;
      if (camera.perspective) {
        low = a * ((a >= 0.0 ? boxes.min[k][i] : boxes.max[k][i]) - camera.position[k]);
        high = a * ((a >= 0.0 ? boxes.max[k][i] : boxes.min[k][i]) - camera.position[k]);
      }
      least += low;
      greatest += high;
    }
    // The farthest point is at most sqrt(3) times as far as on its worst axis.
    const double reach = camera.perspective ? sine * 1.7320508075688773 * far[i] : sine;
    factor[i] = least <= reach && greatest >= -reach ? gain : 1.0;
  }
}

void measure_camera(const View& view, const ViewOptions& options, const ViewColumns& columns,
                    std::size_t first, const Boxes& boxes, const double* error,
                    const std::uint8_t* level, double* want, double* keep, double* distance) {
  const Camera& camera = *view.camera;
  const bool cones = columns.cones() && options.silhouette < 1.0;
  Block depth, near, far, want_gain, keep_gain;
  depth_inside(camera, boxes, depth);
  distances(camera.position, boxes, near, far);
  std::fill_n(want_gain.begin(), boxes.count, 1.0);
  std::fill_n(keep_gain.begin(), boxes.count, 1.0);
  if (cones) {
    const double gain = 1.0 / options.silhouette;
    outlines(camera, columns, first, boxes, 0.0, far, want_gain, gain);
    outlines(camera, columns, first, boxes, options.guard, far, keep_gain, gain);
  }
  const double scale = camera.pixels / view.pixel_error, guard = options.guard;
  for (std::size_t i = 0; i < boxes.count; ++i) {
    const double margin = guard * (camera.perspective ? far[i] : camera.height);
    // Pixels per ground unit. The eye may be inside the box.
    const double unit = camera.perspective ? scale / std::max(near[i], 1e-100) : scale;
    const double shown = std::min(error[i] * unit, kMaxDemand);
    // Clusters above level 0 are wanted early, as the clusters below them have to be requested.
    const double lead = level[i] / (level[i] + 1.0) * margin;
    want[i] =
        std::max(want[i], depth[i] >= -lead ? std::min(shown * want_gain[i], kMaxDemand) : 0.0);
    keep[i] =
        std::max(keep[i], depth[i] >= -margin ? std::min(shown * keep_gain[i], kMaxDemand) : 0.0);
    distance[i] = near[i];
  }
}

Box3 widened(const Box3& box, double guard) {
  double side = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double length = box.max[k] - box.min[k];
    if (std::isfinite(length)) side = std::max(side, length);
  }
  Box3 result = box;
  for (std::size_t k = 0; k < 3; ++k) {
    result.min[k] -= guard * side;
    result.max[k] += guard * side;
  }
  return result;
}

// Calls set(i) for the boxes that intersect this one.
template <class Set>
void for_intersecting(const Box3& box, const Boxes& boxes, Set&& set) {
  for (std::size_t i = 0; i < boxes.count; ++i) {
    bool meet = true;
    for (std::size_t k = 0; k < 3; ++k) {
      meet = meet && box.min[k] <= boxes.max[k][i] && boxes.min[k][i] <= box.max[k];
    }
    if (meet) set(i);
  }
}

double demand_of(double error, double tolerated) {
  if (error == 0.0) return 0.0;
  return tolerated > 0.0 ? std::min(error / tolerated, kMaxDemand) : kMaxDemand;
}

void check(bool good, const char* what) {
  if (!good) throw std::invalid_argument(what);
}

}  // namespace

void ViewColumns::set(std::size_t i, const ClusterRecord& record, unsigned level) {
  set_bounds(i, record);
  levels_[i] = static_cast<std::uint8_t>(level);
  if (cones_) set_cone(i, {});
}

void ViewColumns::set_bounds(std::size_t i, const ClusterRecord& record) {
  const Box3& box = record.box;
  bool empty = false;
  for (std::size_t k = 0; k < 3; ++k) empty = empty || !(box.min[k] <= box.max[k]);
  for (std::size_t k = 0; k < 3; ++k) {
    columns_[k][i] = empty ? kFar : std::clamp(box.min[k], -kFar, kFar);
    columns_[k + 3][i] = empty ? -kFar : std::clamp(box.max[k], -kFar, kFar);
  }
  columns_[kError][i] = record.error >= 0.0 ? std::min(record.error, kFar) : kFar;
}

void ViewColumns::set_cone(std::size_t i, const NormalCone& cone) {
  for (std::size_t k = 0; k < 3; ++k) columns_[kAxis + k][i] = cone.axis[k];
  const double angle = cone.half_angle_degrees;
  // Beyond a right angle, or if it is NaN, any direction is possible.
  columns_[kSine][i] =
      angle >= 0.0 && angle < 90.0 ? std::sin(angle * std::numbers::pi / 180.0) : 1.0;
}

void ViewColumns::copy(std::size_t i, const ViewColumns& from, std::size_t j) {
  for (std::size_t c = 0; c < (cones_ ? kColumns : kAxis); ++c) {
    columns_[c][i] = from.columns_[c][j];
  }
  levels_[i] = from.levels_[j];
}

void ViewColumns::join(std::size_t i, const ViewColumns& from, std::size_t j) {
  for (std::size_t k = 0; k < 3; ++k) {
    columns_[k][i] = std::min(columns_[k][i], from.columns_[k][j]);
    columns_[k + 3][i] = std::max(columns_[k + 3][i], from.columns_[k + 3][j]);
  }
}

std::size_t ViewColumns::memory() const {
  std::size_t bytes = levels_.capacity();
  for (const auto& column : columns_) bytes += column.capacity() * sizeof(double);
  return bytes;
}

void measure(const View& view, const ViewOptions& options, const ViewColumns& columns,
             std::size_t first, std::size_t last, ViewDemand& demand) {
  for (; first < last; first += kBlock) {
    Boxes boxes;
    boxes.count = std::min(kBlock, last - first);
    for (std::size_t k = 0; k < 3; ++k) {
      boxes.min[k] = columns.column(k) + first;
      boxes.max[k] = columns.column(k + 3) + first;
    }
    const double* error = columns.column(ViewColumns::kError) + first;
    const std::uint8_t* level = columns.levels() + first;
    double* want = demand.want.data() + first;
    double* keep = demand.keep.data() + first;
    for (std::size_t i = 0; i < boxes.count; ++i) {
      want[i] = keep[i] =
          std::isinf(view.ground_error) ? 0.0 : demand_of(error[i], view.ground_error);
      demand.distance[first + i] = 0.0;
    }
    if (view.camera) {
      measure_camera(view, options, columns, first, boxes, error, level, want, keep,
                     demand.distance.data() + first);
    }
    const auto raise = [&](const Box3& box, auto&& value) {
      for_intersecting(box, boxes, [&](std::size_t i) { want[i] = std::max(want[i], value(i)); });
      for_intersecting(widened(box, options.guard), boxes,
                       [&](std::size_t i) { keep[i] = std::max(keep[i], value(i)); });
    };
    for (const ErrorRegion& region : view.regions) {
      raise(region.box, [&](std::size_t i) { return demand_of(error[i], region.error); });
    }
    for (const Focus& focus : view.focuses) {
      raise(focus.box,
            [&](std::size_t i) { return level[i] >= focus.level ? ViewDemand::kForced : 0.0; });
    }
  }
}

void check(const View& view) {
  check(view.pixel_error > 0.0, "view: pixel_error must be more than 0");
  check(view.ground_error >= 0.0, "view: ground_error must not be negative");
  for (const ErrorRegion& region : view.regions) {
    check(region.error >= 0.0, "view: the error of a region must not be negative");
  }
}

void check(const ViewOptions& options) {
  check(options.collapse_below > 0.0 && options.collapse_below <= 1.0,
        "view options: collapse_below must be more than 0 and at most 1");
  check(options.ask_above > 0.0, "view options: ask_above must be more than 0");
  check(options.guard >= 0.0 && std::isfinite(options.guard),
        "view options: guard must be finite and not negative");
  check(options.silhouette > 0.0 && options.silhouette <= 1.0,
        "view options: silhouette must be more than 0 and at most 1");
}

}  // namespace terrace::tri
