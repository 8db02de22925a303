// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include <CGAL/Gmpq.h>
#include <CGAL/Simple_cartesian.h>

#include "terrace/tri/shape.hpp"

/// A slow implementation of the rules of shape.hpp from their definition. It identifies tetrahedra
/// by their sorted corners, uses rational numbers for the spheres, and scans every set in each
/// step.

namespace terrace::tri {

using ShapePoint = std::array<double, 3>;
using ShapeCorners = std::array<ShapePoint, 4>;  // sorted
using ShapeSet = std::set<ShapeCorners>;

template <class Coord>
ShapeCorners shape_corners(const Delaunay3<Coord>& triangulation, TetrahedronId t) {
  ShapeCorners result;
  const auto vertices = triangulation.vertices(t);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = triangulation.point(vertices[i]);
    // Merges -0.0 and 0.0.
    for (std::size_t k = 0; k < 3; ++k) result[i][k] = static_cast<double>(p[k]) + 0.0;
  }
  std::sort(result.begin(), result.end());
  return result;
}

template <class Coord>
ShapeSet kept_set(const Delaunay3<Coord>& triangulation, const Shape3<Coord>& shape) {
  ShapeSet result;
  for (const TetrahedronId t : triangulation.all_tetrahedra())
    if (shape.kept(t)) result.insert(shape_corners(triangulation, t));
  return result;
}

inline bool oracle_in_smallest_sphere(const std::array<ShapePoint, 3>& f, const ShapePoint& apex) {
  using Kernel = CGAL::Simple_cartesian<CGAL::Gmpq>;
  const auto exact = [](const ShapePoint& p) {
    return Kernel::Point_3(CGAL::Gmpq(p[0]), CGAL::Gmpq(p[1]), CGAL::Gmpq(p[2]));
  };
  std::array<Kernel::Point_3, 3> p{exact(f[0]), exact(f[1]), exact(f[2])};
  // The smallest sphere is the smallest of the four candidates that contain all three corners.
  std::optional<CGAL::Gmpq> radius2;
  Kernel::Point_3 centre;
  const auto consider = [&](const Kernel::Point_3& at) {
    CGAL::Gmpq r2 = 0;
    for (const auto& q : p) r2 = std::max(r2, CGAL::squared_distance(at, q));
    if (radius2 && *radius2 <= r2) return;
    radius2 = r2;
    centre = at;
  };
  for (std::size_t i = 0; i < 3; ++i) consider(CGAL::midpoint(p[i], p[(i + 1) % 3]));
  consider(CGAL::circumcenter(p[0], p[1], p[2]));
  return CGAL::squared_distance(centre, exact(apex)) < *radius2;
}

inline bool oracle_boundary(const ShapeOptions& options, const std::array<ShapePoint, 3>& f,
                            const ShapePoint& apex) {
  if (options.criterion == ShapeCriterion::gabriel) return !oracle_in_smallest_sphere(f, apex);
  const auto length = [](const ShapePoint& a, const ShapePoint& b) {
    long double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const long double d = static_cast<long double>(a[k]) - static_cast<long double>(b[k]);
      sum += d * d;
    }
    return std::sqrt(sum);
  };
  return length(f[0], f[1]) + length(f[1], f[2]) + length(f[2], f[0]) <
         static_cast<long double>(options.edge_factor) *
             (length(f[0], apex) + length(f[1], apex) + length(f[2], apex));
}

class ShapeOracle {
 public:
  template <class Coord>
  ShapeOracle(const Delaunay3<Coord>& triangulation, const ShapeOptions& options)
      : options_(options) {
    for (const TetrahedronId t : triangulation.all_tetrahedra()) {
      const ShapeCorners corners = shape_corners(triangulation, t);
      kept.insert(corners);
      for (std::size_t i = 0; i < 4; ++i) by_facet_[facet(corners, i)].push_back(corners);
    }
    all_ = kept;
    if (options.rule == ShapeRule::flood) {
      flood();
      if (options.keep_vertices) rescue();
    } else {
      peel();
    }
  }

  ShapeSet kept;
  std::set<ShapePoint> lost;  // before any rescue

 private:
  using Facet = std::array<ShapePoint, 3>;

  static Facet facet(const ShapeCorners& t, std::size_t i) {
    Facet result;
    for (std::size_t j = 0, k = 0; j < 4; ++j)
      if (j != i) result[k++] = t[j];
    return result;
  }
  [[nodiscard]] bool open(const ShapeCorners& t, std::size_t i) const {
    for (const ShapeCorners& other : by_facet_.at(facet(t, i)))
      if (other != t && kept.contains(other)) return false;
    return true;
  }
  [[nodiscard]] bool boundary(const ShapeCorners& t, std::size_t i) const {
    return oracle_boundary(options_, facet(t, i), t[i]);
  }

  void flood() {
    for (bool changed = true; changed;) {
      changed = false;
      for (const ShapeCorners& t : ShapeSet(kept)) {
        for (std::size_t i = 0; i < 4; ++i) {
          if (!open(t, i) || boundary(t, i)) continue;
          kept.erase(t);
          changed = true;
          break;
        }
      }
    }
    lost = uncovered_vertices();
  }
  [[nodiscard]] std::set<ShapePoint> uncovered_vertices() const {
    std::set<ShapePoint> result;
    for (const ShapeCorners& t : all_) result.insert(t.begin(), t.end());
    for (const ShapeCorners& t : kept)
      for (const ShapePoint& p : t) result.erase(p);
    return result;
  }
  void rescue() {
    for (std::set<ShapePoint> uncovered = uncovered_vertices(); !uncovered.empty();
         uncovered = uncovered_vertices()) {
      std::optional<std::tuple<bool, double, ShapeCorners>> best;
      for (const ShapeCorners& t : all_) {
        if (std::none_of(t.begin(), t.end(), [&](const auto& p) { return uncovered.contains(p); }))
          continue;
        bool is_isolated = true;
        for (std::size_t i = 0; i < 4; ++i)
          for (const ShapeCorners& other : by_facet_.at(facet(t, i)))
            if (kept.contains(other)) is_isolated = false;
        double longest2 = 0;
        for (const ShapePoint& p : t) {
          for (const ShapePoint& q : t) {
            const double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
            longest2 = std::max(longest2, x * x + y * y + z * z);
          }
        }
        const std::tuple candidate{is_isolated, longest2, t};
        if (!best || candidate < *best) best = candidate;
      }
      kept.insert(std::get<2>(*best));
    }
  }
  void peel() {
    ShapeSet round;
    for (const ShapeCorners& t : all_)
      for (std::size_t i = 0; i < 4; ++i)
        if (open(t, i)) round.insert(t);
    while (!round.empty()) {
      ShapeSet next;
      for (const ShapeCorners& t : round) {
        if (!kept.contains(t)) continue;
        bool stays = false;
        for (std::size_t i = 0; i < 4; ++i) stays = stays || (open(t, i) && boundary(t, i));
        if (stays) continue;
        kept.erase(t);
        if (options_.keep_vertices) {
          const auto uncovered = uncovered_vertices();
          if (std::any_of(t.begin(), t.end(),
                          [&](const auto& p) { return uncovered.contains(p); })) {
            kept.insert(t);
            continue;
          }
        }
        for (std::size_t i = 0; i < 4; ++i)
          for (const ShapeCorners& other : by_facet_.at(facet(t, i)))
            if (kept.contains(other)) next.insert(other);
      }
      round = next;
    }
    lost = uncovered_vertices();
  }

  ShapeOptions options_;
  ShapeSet all_;
  std::map<Facet, std::vector<ShapeCorners>> by_facet_;
};

}  // namespace terrace::tri
