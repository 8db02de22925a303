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

/// Three corners by index.
using Triangle = std::array<std::uint32_t, 3>;

/// The means of the corners: what a tree over triangles is built from.
/// Throws: std::invalid_argument for a corner that is not there (the triangle is named).
[[nodiscard]] std::vector<Point3> centroids(std::span<const Point3> corners,
                                            std::span<const Triangle> triangles);

/// Queries among triangles. What they answer depends on the triangles alone, not on the tree: of
/// what is equally near the lowest index comes first. Queries may be made by several threads at
/// once.
class TriangleHierarchy {
 public:
  TriangleHierarchy() = default;
  /// rows: of any binary tree over the triangles, see tree_children(). Keeps a copy of the corners,
  /// 72 bytes a triangle.
  /// Throws: as BoundingVolumeHierarchy and centroids() do.
  TriangleHierarchy(std::span<const TreeChildren> rows, std::span<const Point3> corners,
                    std::span<const Triangle> triangles, const HierarchyOptions& options = {});

  /// The first triangle along a ray, from either side. Edges and corners belong to a triangle, so a
  /// ray finds no gap between two that share an edge; a triangle seen exactly edge-on, or without
  /// area, is not hit.
  /// Throws: std::invalid_argument for an origin or direction that is not finite, a direction of
  /// length 0 or some 2^+-1000 times the coordinates, a t that is not a number, and an origin
  /// farther off than 2^400 times the largest coordinate.
  /// Source: S. Woop, C. Benthin, I. Wald, "Watertight ray/triangle intersection", 2013, in double.
  [[nodiscard]] std::optional<RayHit> hit(const Ray& ray) const;

  /// The triangle that comes nearest to a place. Throws as PointHierarchy::nearest() does.
  [[nodiscard]] std::optional<Neighbour> nearest(const Point3& query) const;

  [[nodiscard]] const BoundingVolumeHierarchy<3>& tree() const { return tree_; }

 private:
  BoundingVolumeHierarchy<3> tree_;
  // In the order of the leaves, times the frame's scale.
  std::vector<std::array<Point3, 3>> corners_;
};

}  // namespace terrace::matching
