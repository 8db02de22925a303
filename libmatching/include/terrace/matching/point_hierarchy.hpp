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

/// A primitive and how far it is.
struct Neighbour {
  std::uint32_t index = kNobody;
  double distance = std::numeric_limits<double>::infinity();
  friend bool operator==(const Neighbour&, const Neighbour&) = default;
};

/// The places origin + t * direction with t_min <= t <= t_max; t counts in lengths of the
/// direction.
struct Ray {
  Point3 origin, direction;
  double t_min = 0.0;
  double t_max = std::numeric_limits<double>::infinity();
};

/// The first primitive along a ray.
struct RayHit {
  std::uint32_t index = kNobody;
  double t = 0.0;
  friend bool operator==(const RayHit&, const RayHit&) = default;
};

/// For points, whose own boxes are empty: a test costs a fraction of a step in the tree.
inline constexpr HierarchyOptions kPointLeaves{8, {1.0, 0.25}};

/// Queries among points. What they answer depends on the points alone, not on the tree: of what is
/// equally near the lowest index comes first. Queries may be made by several threads at once.
template <std::size_t D>
class PointHierarchy {
 public:
  using Point = std::array<double, D>;

  PointHierarchy() = default;
  /// rows: of any binary tree over the points, see tree_children(). Keeps a copy of the points.
  /// Throws: as BoundingVolumeHierarchy does.
  PointHierarchy(std::span<const TreeChildren> rows, std::span<const Point> points,
                 const HierarchyOptions& options = kPointLeaves);

  /// The nearest point; nullopt without points.
  /// Throws: std::invalid_argument for a query that is not finite or farther off than 2^400 times
  /// the largest coordinate.
  /// Cost: O(log n) for non-adversarial points and queries; O(k) among k equal points.
  [[nodiscard]] std::optional<Neighbour> nearest(const Point& query) const;

  /// The k nearest, nearest first; fewer if there are not so many. Throws and costs as above.
  void nearest(const Point& query, std::size_t k, std::vector<Neighbour>& found) const;

  /// The first ball along a ray, each point being one of this radius: the least t in the ray's
  /// range at which it is in or on a ball; t_min if it begins in one. Throws: std::invalid_argument
  /// for a ray as TriangleHierarchy::hit() does and a radius that is negative or not finite.
  [[nodiscard]] std::optional<RayHit> hit(const Ray& ray, double radius) const requires(D == 3);

  [[nodiscard]] const BoundingVolumeHierarchy<D>& tree() const { return tree_; }

 private:
  BoundingVolumeHierarchy<D> tree_;
  std::vector<Point> points_;  // in the order of the leaves, times the frame's scale
};

extern template class PointHierarchy<2>;
extern template class PointHierarchy<3>;

}  // namespace terrace::matching
