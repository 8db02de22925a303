// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "terrace/matching/bounding_volume_hierarchy.hpp"
#include "terrace/matching/matching.hpp"
#include "terrace/matching/point.hpp"

namespace terrace::matching {

/// A primitive and its distance.
struct Neighbour {
  std::uint32_t index = kNone;
  double distance = std::numeric_limits<double>::infinity();
  friend bool operator==(const Neighbour&, const Neighbour&) = default;
};

/// The points origin + t * direction with t_min <= t <= t_max. t is in multiples of the direction's
/// length.
struct Ray {
  Point3 origin, direction;
  double t_min = 0.0;
  double t_max = std::numeric_limits<double>::infinity();
};

/// The first primitive along a ray.
struct RayHit {
  std::uint32_t index = kNone;
  double t = 0.0;
  friend bool operator==(const RayHit&, const RayHit&) = default;
};

/// For points, whose boxes are degenerate: testing a point costs a fraction of visiting a node.
inline constexpr HierarchyOptions kPointLeaves{8, {1.0, 0.25}};

/// Queries on a set of points. Results depend on the points alone, not on the tree: ties in
/// distance go to the lowest index. Several threads may query at once.
template <std::size_t D>
class PointHierarchy {
 public:
  using Point = std::array<double, D>;

  PointHierarchy() = default;
  /// Builds the hierarchy and keeps a copy of the points. rows: a binary tree of any kind over the
  /// points, see tree_children().
  /// Throws: as BoundingVolumeHierarchy does.
  PointHierarchy(std::span<const TreeChildren> rows, std::span<const Point> points,
                 const HierarchyOptions& options = kPointLeaves);

  /// Returns the nearest point, or nullopt if there are no points.
  /// Throws: std::invalid_argument for a query that is not finite or farther away than 2^400 times
  /// the largest coordinate.
  /// Cost: O(log n) for non-adversarial points and queries, O(k) among k duplicates.
  [[nodiscard]] std::optional<Neighbour> nearest(const Point& query) const;

  /// Finds the k nearest points, nearest first, or all points if there are fewer than k. Throws and
  /// costs as above.
  void nearest(const Point& query, std::size_t k, std::vector<Neighbour>& found) const;

  /// Returns the first hit of a ray with balls of this radius around the points: the least t in the
  /// ray's range at which the ray is in or on a ball, so t_min if the ray starts inside one.
  /// Throws: std::invalid_argument for a bad ray, as TriangleHierarchy::hit() does, and for a
  /// radius that is negative or not finite.
  [[nodiscard]] std::optional<RayHit> hit(const Ray& ray, double radius) const requires(D == 3);

  [[nodiscard]] const BoundingVolumeHierarchy<D>& tree() const { return tree_; }

 private:
  BoundingVolumeHierarchy<D> tree_;
  std::vector<Point> points_;  // in the order of the leaves, times the frame's scale
};

extern template class PointHierarchy<2>;
extern template class PointHierarchy<3>;

}  // namespace terrace::matching
