// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "terrace/matching/matching_tree.hpp"
#include "terrace/matching/triangle_hierarchy.hpp"

/// Trees of any shape, and answers to queries by brute force.

namespace terrace::matching::oracles {

/// Joins random pairs of roots until one is left.
inline std::vector<TreeChildren> random_tree(std::size_t n, std::mt19937_64& random) {
  std::vector<std::uint32_t> roots(n);
  for (std::uint32_t i = 0; i < n; ++i) roots[i] = i;
  std::vector<TreeChildren> rows;
  const auto take = [&] {
    std::swap(roots[random() % roots.size()], roots.back());
    const std::uint32_t root = roots.back();
    roots.pop_back();
    return root;
  };
  while (roots.size() > 1) {
    const std::uint32_t a = take(), b = take();
    rows.push_back({a, b});
    roots.push_back(static_cast<std::uint32_t>(n + rows.size() - 1));
  }
  return rows;
}

/// Returns a tree of the greatest possible depth.
inline std::vector<TreeChildren> chain_tree(std::size_t n) {
  std::vector<TreeChildren> rows;
  for (std::uint32_t i = 1; i < n; ++i) {
    rows.push_back({i == 1 ? 0 : static_cast<std::uint32_t>(n + i - 2), i});
  }
  return rows;
}

template <class Point>
std::vector<TreeChildren> matching_rows(const std::vector<Point>& points) {
  return tree_children(make_matching_tree(std::span<const Point>(points)).rows);
}

/// Returns all points, nearest first, ties by index.
template <std::size_t D>
std::vector<Neighbour> by_distance(const std::vector<std::array<double, D>>& points,
                                   const std::array<double, D>& query) {
  std::vector<Neighbour> all;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    double sum = 0.0;
    for (std::size_t d = 0; d < D; ++d) {
      sum += (points[i][d] - query[d]) * (points[i][d] - query[d]);
    }
    all.push_back({i, std::sqrt(sum)});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Neighbour& p, const Neighbour& q) { return p.distance < q.distance; });
  return all;
}

using Wide = long double;
using WidePoint = std::array<Wide, 3>;

inline WidePoint wide_difference(const Point3& p, const Point3& q) {
  return {Wide{p[0]} - Wide{q[0]}, Wide{p[1]} - Wide{q[1]}, Wide{p[2]} - Wide{q[2]}};
}

inline WidePoint cross(const WidePoint& p, const WidePoint& q) {
  return {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
}

inline Wide dot(const WidePoint& p, const WidePoint& q) {
  return p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
}

/// Returns the ray parameter t at which a ray crosses a triangle (T. Möller and B. Trumbore, 1997).
/// Barycentric coordinates down to -margin count as inside.
inline std::optional<double> crossing(const Ray& ray, const std::array<Point3, 3>& corners,
                                      Wide margin) {
  const WidePoint direction{ray.direction[0], ray.direction[1], ray.direction[2]};
  const WidePoint first = wide_difference(corners[1], corners[0]);
  const WidePoint second = wide_difference(corners[2], corners[0]);
  const WidePoint p = cross(direction, second), s = wide_difference(ray.origin, corners[0]);
  const WidePoint q = cross(s, first);
  const Wide det = dot(first, p);
  if (det == 0) return std::nullopt;
  const Wide u = dot(s, p) / det, v = dot(direction, q) / det, t = dot(second, q) / det;
  if (u < -margin || v < -margin || u + v > 1 + margin) return std::nullopt;
  if (t < Wide{ray.t_min} || t > Wide{ray.t_max}) return std::nullopt;
  return static_cast<double>(t);
}

/// Returns the ray parameter t at which a ray first enters a ball; t_min if the ray starts inside.
inline std::optional<double> ball_entry(const Ray& ray, const Point3& centre, Wide radius) {
  const WidePoint direction{ray.direction[0], ray.direction[1], ray.direction[2]};
  const WidePoint from_centre = wide_difference(ray.origin, centre);
  const Wide a = dot(direction, direction), b = dot(direction, from_centre),
             c = dot(from_centre, from_centre) - radius * radius;
  const Wide discriminant = b * b - a * c;
  if (discriminant < 0) return std::nullopt;
  const Wide enter = (-b - std::sqrt(discriminant)) / a, leave = (-b + std::sqrt(discriminant)) / a;
  if (leave < Wide{ray.t_min} || enter > Wide{ray.t_max}) return std::nullopt;
  return static_cast<double>(std::max(enter, Wide{ray.t_min}));
}

}  // namespace terrace::matching::oracles
