// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include "terrace/matching/point_hierarchy.hpp"
#include "tree/walk.hpp"

namespace terrace::matching::tree {

/// A ray in the units of the primitives, scaled so that the largest coordinate of its direction is
/// between 1/2 and 1, with the values that box tests need.
class TransformedRay {
 public:
  /// margin: how far outside a box the ray may be and still hit the primitives in it, in the
  /// caller's unit.
  TransformedRay(const Ray& ray, const HierarchyFrame<3>& frame, double margin = 0.0) {
    const QueryPoint<3> query(ray.origin, frame);
    origin = query.scaled;
    frame_origin_ = query.in_frame;
    double largest = 0.0, largest_coordinate = frame.reach;
    for (std::size_t d = 0; d < 3; ++d) {
      if (!std::isfinite(ray.direction[d])) fail("direction is not finite");
      largest = std::max(largest, std::abs(ray.direction[d]));
      largest_coordinate = std::max(largest_coordinate, std::abs(frame_origin_[d]));
    }
    if (largest == 0.0) fail("direction has length 0");
    if (std::isnan(ray.t_min) || std::isnan(ray.t_max)) fail("t_min or t_max is not a number");
    const int exponent = std::ilogb(largest) + 1;
    unit_ = std::ldexp(frame.scale, exponent);
    if (!(unit_ <= 0x1p1000) || !(unit_ >= 0x1p-1000)) {
      fail("direction is too long or too short for coordinates of this size");
    }
    t_min = ray.t_min * unit_;
    t_max = ray.t_max * unit_;
    // The error of a hit is about 2^-51 of the largest coordinate involved.
    const double tolerance =
        margin * frame.scale + 0x1p-48 * (largest_coordinate + margin * frame.scale);
    for (std::size_t d = 0; d < 3; ++d) {
      direction[d] = std::ldexp(ray.direction[d], -exponent);
      inverse_[d] = 1.0 / direction[d];
      negative_[d] = std::signbit(direction[d]);
      origin_for_min_[d] = frame_origin_[d] + tolerance;
      origin_for_max_[d] = frame_origin_[d] - tolerance;
    }
  }

  /// Converts t of this ray to t of the ray that was passed in.
  [[nodiscard]] double input_t(double t) const { return t / unit_; }

  struct Range {
    double enter, leave;
    [[nodiscard]] bool empty() const { return !(enter <= leave); }
  };

  /// Returns the interval from t_min to `last` in which the ray is inside the box. If a coordinate
  /// of the direction is 0 and the origin is on the box's border, 0 times infinity is ignored: that
  /// axis excludes nothing.
  template <class AnyBox>
  [[nodiscard]] Range clip(const AnyBox& box, double last) const {
    Range range{t_min, last};
    for (std::size_t d = 0; d < 3; ++d) {
      const double lo = (static_cast<double>(box.min[d]) - origin_for_min_[d]) * inverse_[d];
      const double hi = (static_cast<double>(box.max[d]) - origin_for_max_[d]) * inverse_[d];
      const double enter = negative_[d] ? hi : lo;
      const double leave = negative_[d] ? lo : hi;
      range.enter = enter > range.enter ? enter : range.enter;
      range.leave = leave < range.leave ? leave : range.leave;
    }
    return range;
  }

  /// Moves the t of a hit to the nearest t at which the ray is inside the primitive's box, or
  /// nullopt if there is none. So an earlier hit never makes the walk skip a node around this one,
  /// and all trees give the same answer. The change is a few roundings, except for triangles seen
  /// nearly edge-on. The box's coordinates are in the units of the primitives.
  [[nodiscard]] std::optional<double> clamp_to_box(base::Box3 box, const HierarchyFrame<3>& frame,
                                                   double t) const {
    for (std::size_t d = 0; d < 3; ++d) {
      box.min[d] -= frame.centre[d];
      box.max[d] -= frame.centre[d];
    }
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const Range range = clip(box, kInfinity);
    if (range.empty()) return std::nullopt;
    return std::clamp(t, range.enter, range.leave);
  }

  Point3 origin, direction;
  double t_min, t_max;

 private:
  [[noreturn]] static void fail(const char* what) {
    throw std::invalid_argument(std::string("a ray's ") + what);
  }

  Point3 frame_origin_, inverse_, origin_for_min_, origin_for_max_;
  std::array<bool, 3> negative_;
  double unit_;
};

/// Calls leaf(node, best) for each leaf that the ray enters no later than the best hit so far,
/// nearer leaves first. leaf() lowers best.t, which is in units of the transformed ray.
template <class Leaf>
RayHit walk_ray(const BoundingVolumeHierarchy<3>& tree, const TransformedRay& ray, Leaf&& leaf) {
  constexpr double kMiss = std::numeric_limits<double>::infinity();
  RayHit best{kNone, ray.t_max};
  walk(
      tree,
      [&](const HierarchyNode<3>& node) {
        const auto range = ray.clip(node, best.t);
        return range.empty() ? kMiss : range.enter;
      },
      [&](double enter) { return enter < kMiss && enter <= best.t; },
      [&](const HierarchyNode<3>& node) { leaf(node, best); });
  return best;
}

}  // namespace terrace::matching::tree
