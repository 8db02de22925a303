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

/// The mean of each triangle's corners, from which a tree over triangles is built.
/// Throws: std::invalid_argument for a corner out of range (the triangle is named).
[[nodiscard]] std::vector<Point3> centroids(std::span<const Point3> corners,
                                            std::span<const Triangle> triangles);

/// Queries among triangles. Results depend on the triangles alone, not on the tree: ties go to the
/// lowest index. Safe to query from several threads at once.
class TriangleHierarchy {
 public:
  TriangleHierarchy() = default;
  /// rows: a binary tree of any kind over the triangles, see tree_children(). Keeps a copy of the
  /// corners, 72 bytes per triangle.
  /// Throws: as BoundingVolumeHierarchy and centroids() do.
  TriangleHierarchy(std::span<const TreeChildren> rows, std::span<const Point3> corners,
                    std::span<const Triangle> triangles, const HierarchyOptions& options = {});

  /// The first triangle along a ray, from either side. Edges and corners belong to a triangle, so a
  /// ray cannot slip between two triangles that share an edge; a triangle seen exactly edge-on, or
  /// without area, is not hit.
  /// Throws: std::invalid_argument for an origin or direction that is not finite, a direction of
  /// length 0 or of some 2^+-1000 times the coordinates, a t that is NaN, and an origin farther
  /// away than 2^400 times the largest coordinate.
  /// Source: S. Woop, C. Benthin, I. Wald, "Watertight ray/triangle intersection", 2013, in double.
  [[nodiscard]] std::optional<RayHit> hit(const Ray& ray) const;

  /// The triangle nearest to a point. Throws as PointHierarchy::nearest() does.
  [[nodiscard]] std::optional<Neighbour> nearest(const Point3& query) const;

  [[nodiscard]] const BoundingVolumeHierarchy<3>& tree() const { return tree_; }

 private:
  BoundingVolumeHierarchy<3> tree_;
  // In the order of the leaves, times the frame's scale.
  std::vector<std::array<Point3, 3>> corners_;
};

}  // namespace terrace::matching
