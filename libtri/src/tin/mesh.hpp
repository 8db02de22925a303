// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

/// Triangles linked to their neighbours, and the insertion of a vertex. Shared by all TINs.

namespace terrace::tri::tin {

inline constexpr std::uint32_t kNone = 0xFFFFFFFF;

/// Side i is opposite to corner i, from corner i + 1 to corner i + 2.
struct Triangle {
  std::array<std::uint32_t, 3> corner;  ///< counter-clockwise; corner[0] == kNone: not a triangle
  std::array<std::uint32_t, 3> next;    ///< the triangle across side i, or kNone
  std::uint32_t place;                  ///< the sample or point with the greatest error
  float error;                          ///< positive while `place` waits to be inserted

  bool live() const { return corner[0] != kNone; }
};

using Triangles = std::vector<Triangle>;

/// Triangles with the coordinates of their corners. `Vertices` is an array of vertices.
template <class Vertices>
struct Mesh {
  Vertices vertices;
  Triangles triangles;

  const auto& vertex(const Triangle& triangle, unsigned i) const {
    return vertices[triangle.corner[i]];
  }
};

/// The place of a point in a mesh.
struct Spot {
  std::uint32_t triangle = kNone;  ///< contains the point. kNone: outside
  unsigned zeros = 0;              ///< number of its sides whose lines contain the point
  unsigned side = 0;               ///< one of these
  bool border = false;             ///< the point is on the mesh's border, between two vertices
};

/// The side that a walk tries first in each triangle. In a Delaunay triangulation a walk ends
/// whatever side that is.
struct LowestSide {
  explicit LowestSide(std::uint32_t) {}
  static unsigned next() { return 0; }
};
/// Varies, so that a walk cannot be endless in a mesh that is not Delaunay.
struct RandomSide {
  explicit RandomSide(std::uint32_t start) : random(start * 2654435761u + 1) {}
  unsigned next() {
    random = random * 1664525u + 1013904223u;
    return (random >> 16) % 3;
  }
  std::uint32_t random;
};

/// An error as stored in Triangle::error: rounded up, positive, finite.
inline float rounded_up(double error) {
  constexpr float kHighest = std::numeric_limits<float>::max();
  if (!(error < double{kHighest})) return kHighest;
  const auto rounded = static_cast<float>(error);
  return rounded < error || rounded == 0 ? std::nextafter(rounded, kHighest) : rounded;
}

/// Triangle::place for a sample in rows and columns, at most 65,535 of each.
inline constexpr std::uint32_t place_at(std::int32_t column, std::int32_t row) {
  return static_cast<std::uint32_t>(row) << 16 | static_cast<std::uint32_t>(column);
}
inline constexpr std::int32_t column_of(std::uint32_t place) {
  return static_cast<std::int32_t>(place & 0xFFFF);
}
inline constexpr std::int32_t row_of(std::uint32_t place) {
  return static_cast<std::int32_t>(place >> 16);
}

inline constexpr unsigned next_side(unsigned side) { return side == 2 ? 0 : side + 1; }
inline constexpr unsigned previous_side(unsigned side) { return side == 0 ? 2 : side - 1; }

/// The side of `triangle` across which its neighbour `neighbour` is.
inline unsigned side_to(const Triangle& triangle, std::uint32_t neighbour) {
  return triangle.next[0] == neighbour ? 0 : triangle.next[1] == neighbour ? 1 : 2;
}

/// The index of `vertex` among the corners of `triangle`.
inline unsigned corner_of(const Triangle& triangle, std::uint32_t vertex) {
  return triangle.corner[0] == vertex ? 0 : triangle.corner[1] == vertex ? 1 : 2;
}

/// A triangle of each vertex, or kNone for vertices without triangles.
inline std::vector<std::uint32_t> triangle_of_vertices(const Triangles& triangles,
                                                       std::size_t vertices) {
  std::vector<std::uint32_t> result(vertices, kNone);
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    if (triangles[t].live())
      for (const std::uint32_t vertex : triangles[t].corner) result[vertex] = t;
  return result;
}

/// Inserts a vertex into a Delaunay triangulation: replaces the triangles whose circles contain it
/// by triangles of the vertex and the sides of the hole (A. Bowyer, D. F. Watson, 1981).
class Cavity {
 public:
  /// Collects the triangles to remove: `first`, which contains the new vertex, and those reachable
  /// from it for which `inside(triangle)` holds (its circle strictly contains the vertex).
  template <class Inside>
  void grow(const Triangles& triangles, std::uint32_t first, const Inside& inside) {
    edges_.clear();
    removed_.assign(1, first);
    stack_.assign({{first, 2}, {first, 1}, {first, 0}});
    while (!stack_.empty()) {
      const auto [t, side] = stack_.back();
      stack_.pop_back();
      const std::uint32_t neighbour = triangles[t].next[side];
      const unsigned outer_side = neighbour == kNone ? 0 : side_to(triangles[neighbour], t);
      if (neighbour != kNone && inside(triangles[neighbour])) {
        removed_.push_back(neighbour);
        stack_.push_back({neighbour, previous_side(outer_side)});
        stack_.push_back({neighbour, next_side(outer_side)});
      } else {
        edges_.push_back({triangles[t].corner[next_side(side)],
                          triangles[t].corner[previous_side(side)], neighbour, outer_side});
      }
    }
  }

  /// Fills the hole with the triangles of `vertex` and its sides. `flat(a, b)`: true for a side on
  /// the hull if the vertex is on it. Such a side is split in two. The new triangles have the
  /// vertex as corner 0. Their `place` and `error` are 0.
  template <class Flat>
  void fill(Triangles& triangles, std::uint32_t vertex, const Flat& flat) {
    bool on_border = false;
    for (std::size_t i = 0; i < edges_.size() && !on_border; ++i) {
      if (edges_[i].outer != kNone || !flat(edges_[i].a, edges_[i].b)) continue;
      on_border = true;  // the other sides are a chain that starts after it
      rotated_.assign(edges_.begin() + static_cast<std::ptrdiff_t>(i) + 1, edges_.end());
      rotated_.insert(rotated_.end(), edges_.begin(),
                      edges_.begin() + static_cast<std::ptrdiff_t>(i));
      std::swap(edges_, rotated_);
    }
    const std::size_t count = edges_.size();
    assert(count >= removed_.size());
    created_ = removed_;
    while (created_.size() < count) {
      created_.push_back(static_cast<std::uint32_t>(triangles.size()));
      triangles.emplace_back();
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Edge& edge = edges_[i];
      const std::uint32_t following = i + 1 < count ? created_[i + 1]
                                      : on_border   ? kNone
                                                    : created_[0];
      const std::uint32_t preceding = i > 0       ? created_[i - 1]
                                      : on_border ? kNone
                                                  : created_[count - 1];
      triangles[created_[i]] = {
          {vertex, edge.a, edge.b}, {edge.outer, following, preceding}, 0, 0.0F};
      if (edge.outer != kNone) triangles[edge.outer].next[edge.outer_side] = created_[i];
    }
  }

  /// The triangles made by fill(), which reuse all slots of the removed ones.
  const std::vector<std::uint32_t>& created() const { return created_; }

 private:
  struct Edge {
    std::uint32_t a, b;   ///< along the hole, counter-clockwise
    std::uint32_t outer;  ///< the triangle beyond, or kNone
    unsigned outer_side;  ///< the side of `outer` towards the hole
  };
  std::vector<Edge> edges_, rotated_;
  std::vector<std::uint32_t> removed_, created_;
  std::vector<std::pair<std::uint32_t, unsigned>> stack_;
};

}  // namespace terrace::tri::tin
