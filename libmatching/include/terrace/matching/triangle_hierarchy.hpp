// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "terrace/matching/point_hierarchy.hpp"

namespace terrace::matching {

/// The indices of three corners.
using Triangle = std::array<std::uint32_t, 3>;

/// Returns the mean of each triangle's corners, from which to build a tree over triangles.
/// Throws: std::invalid_argument for a corner out of range (the message names the triangle).
[[nodiscard]] std::vector<Point3> centroids(std::span<const Point3> corners,
                                            std::span<const Triangle> triangles);

/// Queries on a set of triangles. Results depend on the triangles alone, not on the tree: ties go
/// to the lowest index. Several threads may query at once.
class TriangleHierarchy {
 public:
  TriangleHierarchy() = default;
  /// Builds the hierarchy and keeps a copy of the corners, 72 bytes per triangle.
  /// rows: a binary tree of any kind over the triangles, see tree_children().
  /// Throws: as BoundingVolumeHierarchy and centroids() do.
  TriangleHierarchy(std::span<const TreeChildren> rows, std::span<const Point3> corners,
                    std::span<const Triangle> triangles, const HierarchyOptions& options = {});

  /// Returns the first triangle along a ray, hit from either side. Edges and corners belong to a
  /// triangle, so a ray cannot slip between two triangles that share an edge. A triangle seen
  /// exactly edge-on, or without area, is not hit.
  /// Throws: std::invalid_argument for an origin or direction that is not finite, a direction of
  /// length 0 or of about 2^+-1000 times the coordinates, a t that is NaN, and an origin farther
  /// away than 2^400 times the largest coordinate.
  /// Source: S. Woop, C. Benthin, I. Wald, "Watertight ray/triangle intersection", 2013, in double.
  [[nodiscard]] std::optional<RayHit> hit(const Ray& ray) const;

  /// Returns the triangle nearest to a point. Throws as PointHierarchy::nearest() does.
  [[nodiscard]] std::optional<Neighbour> nearest(const Point3& query) const;

  [[nodiscard]] const BoundingVolumeHierarchy<3>& tree() const { return tree_; }

 private:
  BoundingVolumeHierarchy<3> tree_;
  // In the order of the leaves, times the frame's scale.
  std::vector<std::array<Point3, 3>> corners_;
};

}  // namespace terrace::matching
