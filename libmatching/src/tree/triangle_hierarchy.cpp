// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/triangle_hierarchy.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "terrace/matching/point.hpp"
#include "tree/nearest.hpp"
#include "tree/ray_walk.hpp"

namespace terrace::matching::tree {

using Corners = std::array<Point3, 3>;

/// A ray transformed to the z axis: the part of the test that all triangles share.
/// Source: S. Woop, C. Benthin, I. Wald, "Watertight ray/triangle intersection", 2013.
class TriangleTest {
 public:
  TriangleTest(const Point3& origin, const Point3& direction) : origin_(origin) {
    for (std::size_t d = 1; d < 3; ++d) {
      if (std::abs(direction[d]) > std::abs(direction[z_])) z_ = d;
    }
    x_ = (z_ + 1) % 3;
    y_ = (z_ + 2) % 3;
    shear_x_ = direction[x_] / direction[z_];
    shear_y_ = direction[y_] / direction[z_];
    scale_z_ = 1.0 / direction[z_];
  }

  /// Returns t of the intersection, or nullopt. The signs of u, v and w are correct, or 0, for the
  /// sheared corners, because products are rounded monotonically. So at a shared edge one of the
  /// two triangles is hit.
  [[nodiscard]] std::optional<double> operator()(const Corners& corners) const {
    std::array<double, 3> x, y, z;
    for (std::size_t k = 0; k < 3; ++k) {
      z[k] = corners[k][z_] - origin_[z_];
      x[k] = corners[k][x_] - origin_[x_] - shear_x_ * z[k];
      y[k] = corners[k][y_] - origin_[y_] - shear_y_ * z[k];
    }
    const double u = x[2] * y[1] - y[2] * x[1];
    const double v = x[0] * y[2] - y[0] * x[2];
    const double w = x[1] * y[0] - y[1] * x[0];
    if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) return std::nullopt;
    const double sum = u + v + w;
    if (sum == 0.0) return std::nullopt;
    return scale_z_ * ((u * z[0] + v * z[1] + w * z[2]) / sum);
  }

 private:
  Point3 origin_;
  std::size_t x_ = 0, y_ = 0, z_ = 0;
  double shear_x_, shear_y_, scale_z_;
};

inline Point3 difference(const Point3& p, const Point3& q) {
  return {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
}

inline double dot(const Point3& p, const Point3& q) {
  return p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
}

/// Returns the squared distance of a point to the segment from p to q.
inline double squared_distance(const Point3& place, const Point3& p, const Point3& q) {
  const Point3 side = difference(q, p), offset = difference(place, p);
  const double length2 = dot(side, side);
  const double share = length2 > 0.0 ? std::clamp(dot(offset, side) / length2, 0.0, 1.0) : 0.0;
  const Point3 perpendicular{offset[0] - share * side[0], offset[1] - share * side[1],
                             offset[2] - share * side[2]};
  return dot(perpendicular, perpendicular);
}

/// Returns the squared distance of a point to a triangle: to its plane if the foot is inside,
/// otherwise to the nearest side. For triangles of nearly zero area the sides are tested as well,
/// so that none is missed.
inline double squared_distance(const Point3& place, const Corners& corners) {
  const Point3 first = difference(corners[1], corners[0]);
  const Point3 second = difference(corners[2], corners[0]);
  const Point3 offset = difference(place, corners[0]);
  const double aa = dot(first, first), ab = dot(first, second), bb = dot(second, second);
  const double at = dot(first, offset), bt = dot(second, offset), area2 = aa * bb - ab * ab;
  const double u = bb * at - ab * bt, v = aa * bt - ab * at;
  double least = std::numeric_limits<double>::infinity();
  if (area2 > 0.0 && u > 0.0 && v > 0.0 && u + v < area2) {
    const double s = u / area2, t = v / area2;
    const Point3 perpendicular{offset[0] - s * first[0] - t * second[0],
                               offset[1] - s * first[1] - t * second[1],
                               offset[2] - s * first[2] - t * second[2]};
    least = dot(perpendicular, perpendicular);
    if (area2 > 1e-8 * aa * bb) return least;
  }
  return std::min({least, squared_distance(place, corners[0], corners[1]),
                   squared_distance(place, corners[1], corners[2]),
                   squared_distance(place, corners[2], corners[0])});
}

}  // namespace terrace::matching::tree

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

tree::Corners corners_of(std::span<const Point3> corners, const Triangle& triangle) {
  return {corners[triangle[0]], corners[triangle[1]], corners[triangle[2]]};
}

std::vector<base::Box3> boxes_of(std::span<const Point3> corners,
                                 std::span<const Triangle> triangles) {
  check_corners(corners, triangles);
  std::vector<base::Box3> boxes;
  boxes.reserve(triangles.size());
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    const tree::Corners triangle_corners = corners_of(corners, triangles[k]);
    boxes.push_back(base::box_of(triangle_corners));
    // A box ignores NaN.
    for (const Point3& p : triangle_corners) {
      for (const double c : p) {
        if (std::isnan(c)) boxes.back().min[0] = c;
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
  const tree::TransformedRay transformed(ray, tree_.frame());
  const tree::TriangleTest intersect(transformed.origin, transformed.direction);
  const RayHit best =
      tree::walk_ray(tree_, transformed, [&](const HierarchyNode<3>& leaf, RayHit& first) {
        for (std::uint32_t slot = leaf.link; slot < leaf.link + leaf.count; ++slot) {
          const std::optional<double> t_plane = intersect(corners_[slot]);
          if (!t_plane || *t_plane < transformed.t_min || *t_plane > transformed.t_max) continue;
          const std::optional<double> t =
              transformed.clamp_to_box(base::box_of(corners_[slot]), tree_.frame(), *t_plane);
          if (!t) continue;
          const std::uint32_t index = tree_.order()[slot];
          if (*t < first.t || (*t == first.t && index < first.index)) first = {index, *t};
        }
      });
  if (best.index == kNone) return std::nullopt;
  return RayHit{best.index, transformed.input_t(best.t)};
}

std::optional<Neighbour> TriangleHierarchy::nearest(const Point3& query) const {
  const tree::QueryPoint<3> place(query, tree_.frame());
  return tree::nearest_one(tree_, place.in_frame, [&](std::uint32_t slot) {
    // The result is never less than the distance to the box, which prunes nodes, whatever the
    // rounding.
    return std::max(tree::squared_distance(place.scaled, corners_[slot]),
                    tree::squared_distance(base::box_of(corners_[slot]), place.scaled));
  });
}

}  // namespace terrace::matching
