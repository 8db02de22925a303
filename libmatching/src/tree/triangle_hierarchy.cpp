// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/triangle_hierarchy.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "tree/nearest.hpp"
#include "tree/ray_walk.hpp"
#include "tree/triangle_test.hpp"

namespace terrace::matching {
namespace {

void check_corners(std::span<const Point3> corners, std::span<const Triangle> triangles) {
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    for (const std::uint32_t corner : triangles[k]) {
      if (corner < corners.size()) continue;
      throw std::invalid_argument("triangle " + std::to_string(k) + " names corner " +
                                  std::to_string(corner) + " of " + std::to_string(corners.size()) +
                                  "; leave it out");
    }
  }
}

Box<3> box_of(const tree::Corners& corners) {
  Box<3> box{corners[0], corners[0]};
  for (std::size_t k = 1; k < 3; ++k) {
    for (std::size_t d = 0; d < 3; ++d) {
      box.lo[d] = std::min(box.lo[d], corners[k][d]);
      box.hi[d] = std::max(box.hi[d], corners[k][d]);
    }
  }
  return box;
}

tree::Corners corners_of(std::span<const Point3> corners, const Triangle& triangle) {
  return {corners[triangle[0]], corners[triangle[1]], corners[triangle[2]]};
}

std::vector<Box<3>> boxes_of(std::span<const Point3> corners, std::span<const Triangle> triangles) {
  check_corners(corners, triangles);
  std::vector<Box<3>> boxes;
  boxes.reserve(triangles.size());
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    const tree::Corners own = corners_of(corners, triangles[k]);
    boxes.push_back(box_of(own));
    // If one argument is NaN, std::min and std::max may return the other.
    for (const Point3& p : own) {
      for (const double c : p) {
        if (std::isnan(c)) boxes.back().lo[0] = c;
      }
    }
  }
  return boxes;
}

}  // namespace

std::vector<Point3> centroids(std::span<const Point3> corners,
                              std::span<const Triangle> triangles) {
  check_corners(corners, triangles);
  std::vector<Point3> means(triangles.size());
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    for (const std::uint32_t corner : triangles[k]) {
      // Divides each corner before adding, so that the sum does not overflow.
      for (std::size_t d = 0; d < 3; ++d) means[k][d] += corners[corner][d] / 3.0;
    }
  }
  return means;
}

TriangleHierarchy::TriangleHierarchy(std::span<const TreeChildren> rows,
                                     std::span<const Point3> corners,
                                     std::span<const Triangle> triangles,
                                     const HierarchyOptions& options)
    : tree_(rows, boxes_of(corners, triangles), options), corners_(triangles.size()) {
  for (std::size_t slot = 0; slot < corners_.size(); ++slot) {
    corners_[slot] = corners_of(corners, triangles[tree_.order()[slot]]);
    for (Point3& p : corners_[slot]) {
      for (double& c : p) c *= tree_.frame().scale;
    }
  }
}

std::optional<RayHit> TriangleHierarchy::hit(const Ray& ray) const {
  const tree::FramedRay framed(ray, tree_.frame());
  const tree::TriangleTest crossing(framed.origin, framed.direction);
  const RayHit best =
      tree::walk_ray(tree_, framed, [&](const HierarchyNode<3>& leaf, RayHit& first) {
        for (std::uint32_t slot = leaf.link; slot < leaf.link + leaf.count; ++slot) {
          const std::optional<double> met = crossing(corners_[slot]);
          if (!met || *met < framed.t_min || *met > framed.t_max) continue;
          const std::optional<double> t =
              framed.moved_into(box_of(corners_[slot]), tree_.frame(), *met);
          if (!t) continue;
          const std::uint32_t index = tree_.order()[slot];
          if (*t < first.t || (*t == first.t && index < first.index)) first = {index, *t};
        }
      });
  if (best.index == kNobody) return std::nullopt;
  return RayHit{best.index, framed.callers_t(best.t)};
}

std::optional<Neighbour> TriangleHierarchy::nearest(const Point3& query) const {
  const tree::FramedPlace<3> place(query, tree_.frame());
  return tree::nearest_one(tree_, place.framed, [&](std::uint32_t slot) {
    // The result is never less than the distance to the box, which prunes nodes, whatever the
    // rounding.
    return std::max(tree::squared_distance(place.scaled, corners_[slot]),
                    tree::squared_distance(box_of(corners_[slot]), place.scaled));
  });
}

}  // namespace terrace::matching
