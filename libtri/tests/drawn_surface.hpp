// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "terrace/tri/dynamic_surface.hpp"
#include "terrace/tri/shape.hpp"

/// Visible surfaces: their triangles as points, each starting at its smallest corner.

namespace terrace::tri::test {

/// The state of a renderer: the corners of triangles as they were when they were reported.
template <class Coord>
class Drawn {
 public:
  using Points = std::array<std::array<Coord, 3>, 3>;

  explicit Drawn(const DynamicSurface<Coord>& surface) : surface_(&surface), drawn_(now()) {}
  void apply(const typename DynamicSurface<Coord>::Changes& changes) {
    ASSERT_EQ(changes.removed_triangles.size(), changes.removed_corners.size());
    for (const TriangleId t : changes.removed_triangles) ASSERT_EQ(drawn_.erase(t), 1u);
    for (const TriangleId t : changes.added_triangles) {
      ASSERT_TRUE(surface_->alive(t));
      ASSERT_TRUE(drawn_.emplace(t, points(t)).second);
    }
  }
  void check() const {
    ASSERT_EQ(drawn_.size(), surface_->triangle_count());
    ASSERT_EQ(drawn_, now());
    std::map<VertexId, std::size_t> count;
    for (const auto& [triangle, corners] : drawn_) {
      for (const VertexId corner : surface_->vertices(triangle)) ++count[corner];
    }
    for (const VertexId v : surface_->all_vertices())
      ASSERT_EQ(surface_->triangles_at(v), count[v]);
  }
  [[nodiscard]] std::multiset<Points> triangles() const {
    std::multiset<Points> all;
    for (const auto& [triangle, corners] : drawn_) all.insert(from_least(corners));
    return all;
  }
  static Points from_least(Points p) {
    std::rotate(p.begin(), std::min_element(p.begin(), p.end()), p.end());
    return p;
  }

 private:
  [[nodiscard]] Points points(TriangleId t) const {
    const auto [a, b, c] = surface_->vertices(t);
    return {surface_->point(a), surface_->point(b), surface_->point(c)};
  }
  [[nodiscard]] std::map<TriangleId, Points> now() const {
    std::map<TriangleId, Points> all;
    for (const TriangleId t : surface_->all_triangles()) all.emplace(t, points(t));
    return all;
  }
  const DynamicSurface<Coord>* surface_;
  std::map<TriangleId, Points> drawn_;
};

template <class Coord>
auto faces_of(const ShapeSurface& surface, const Delaunay3<Coord>& triangulation) {
  std::multiset<typename Drawn<Coord>::Points> all;
  for (const auto& face : surface.surface.faces) {
    typename Drawn<Coord>::Points p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = triangulation.point(surface.vertices[face[i]]);
    all.insert(Drawn<Coord>::from_least(p));
  }
  return all;
}

}  // namespace terrace::tri::test
