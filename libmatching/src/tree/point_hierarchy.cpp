// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/point_hierarchy.hpp"

#include <cmath>
#include <stdexcept>

#include "tree/nearest.hpp"
#include "tree/ray_walk.hpp"

namespace terrace::matching {
namespace {

template <std::size_t D>
std::vector<base::Box<D>> boxes_of(std::span<const std::array<double, D>> points) {
  std::vector<base::Box<D>> boxes;
  boxes.reserve(points.size());
  for (const auto& p : points) boxes.push_back({p, p});
  return boxes;
}

template <std::size_t D>
double squared_distance(const std::array<double, D>& p, const std::array<double, D>& q) {
  double sum = 0.0;
  for (std::size_t d = 0; d < D; ++d) sum += (p[d] - q[d]) * (p[d] - q[d]);
  return sum;
}

double dot(const Point3& p, const Point3& q) { return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]; }

/// Returns the least t in the ray's range at which the ray is in or on a ball. Starts from the
/// point of the ray nearest to the centre, which keeps distant balls accurate (E. Haines et al.,
/// "Precision improvements for ray/sphere intersection", 2019).
std::optional<double> intersect_ball(const tree::TransformedRay& ray, const Point3& centre,
                                     double radius) {
  const Point3& direction = ray.direction;
  const Point3 offset{centre[0] - ray.origin[0], centre[1] - ray.origin[1],
                      centre[2] - ray.origin[2]};
  const double length2 = dot(direction, direction), middle = dot(offset, direction) / length2;
  const Point3 perpendicular{offset[0] - middle * direction[0], offset[1] - middle * direction[1],
                             offset[2] - middle * direction[2]};
  const double half2 = radius * radius - dot(perpendicular, perpendicular);
  if (!(half2 >= 0.0)) return std::nullopt;
  const double half_chord = std::sqrt(half2 / length2);
  if (middle + half_chord < ray.t_min || middle - half_chord > ray.t_max) return std::nullopt;
  return std::max(middle - half_chord, ray.t_min);
}

}  // namespace

template <std::size_t D>
PointHierarchy<D>::PointHierarchy(std::span<const TreeChildren> rows, std::span<const Point> points,
                                  const HierarchyOptions& options)
    : tree_(rows, boxes_of<D>(points), options), points_(points.size()) {
  for (std::size_t slot = 0; slot < points_.size(); ++slot) {
    points_[slot] = points[tree_.order()[slot]];
    for (double& c : points_[slot]) c *= tree_.frame().scale;
  }
}

template <std::size_t D>
std::optional<Neighbour> PointHierarchy<D>::nearest(const Point& query) const {
  const tree::QueryPoint<D> point(query, tree_.frame());
  return tree::nearest_one(tree_, point.in_frame, [&](std::uint32_t slot) {
    return squared_distance(points_[slot], point.scaled);
  });
}

template <std::size_t D>
void PointHierarchy<D>::nearest(const Point& query, std::size_t k,
                                std::vector<Neighbour>& found) const {
  const tree::QueryPoint<D> point(query, tree_.frame());
  tree::nearest_few(
      tree_, point.in_frame, k,
      [&](std::uint32_t slot) { return squared_distance(points_[slot], point.scaled); }, found);
}

template <std::size_t D>
std::optional<RayHit> PointHierarchy<D>::hit(const Ray& ray, double radius) const requires(D == 3) {
  // Clang 14 also instantiates this in the plane.
  if constexpr (D == 3) {
    const double scaled = radius * tree_.frame().scale;
    if (!(radius >= 0.0) || !(scaled <= 0x1p460)) {
      throw std::invalid_argument(
          "the radius is " + std::to_string(radius) +
          "; it must be finite, not negative, and comparable to the coordinates");
    }
    const tree::TransformedRay transformed(ray, tree_.frame(), radius);
    const RayHit best =
        tree::walk_ray(tree_, transformed, [&](const HierarchyNode<3>& leaf, RayHit& first) {
          for (std::uint32_t slot = leaf.link; slot < leaf.link + leaf.count; ++slot) {
            const std::optional<double> entry = intersect_ball(transformed, points_[slot], scaled);
            if (!entry) continue;
            const std::optional<double> t =
                transformed.clamp_to_box({points_[slot], points_[slot]}, tree_.frame(), *entry);
            if (!t) continue;
            const std::uint32_t index = tree_.order()[slot];
            if (*t < first.t || (*t == first.t && index < first.index)) first = {index, *t};
          }
        });
    if (best.index != kNone) return RayHit{best.index, transformed.input_t(best.t)};
  }
  return std::nullopt;
}

template class PointHierarchy<2>;
template class PointHierarchy<3>;

}  // namespace terrace::matching
