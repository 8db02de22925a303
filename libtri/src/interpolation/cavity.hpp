// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "place.hpp"

/// Finds the triangles that the insertion of a query would remove, without inserting it.

namespace terrace::tri::planar {

/// The parts that the geometry of the query's Voronoi cell needs. Numbers of corners, triangles and
/// so on are local: indices into these arrays, which keep their capacity between queries.
struct Cavity {
  struct Corner {
    std::uint32_t vertex;
    Query at;
  };
  /// An inner edge, counter-clockwise for the triangle `left`.
  struct Link {
    std::uint32_t from;
    std::uint32_t to;
    std::uint32_t left;
    std::uint32_t right;
  };
  /// An edge of the boundary, counter-clockwise, and the triangle inside.
  struct Edge {
    std::uint32_t from;
    std::uint32_t to;
    std::uint32_t triangle;
  };
  struct Pending {
    Side side;
    Edge edge;
  };
  std::vector<Corner> corner;
  std::vector<std::array<std::uint32_t, 3>> triangle;
  std::vector<Link> link;
  std::vector<Edge> rim;         ///< closed: edge i + 1 starts where edge i ends
  std::vector<Pending> pending;  ///< scratch: a stack shared by nested calls

  void clear() {
    corner.clear();
    triangle.clear();
    link.clear();
    rim.clear();
  }
};

/// Finds the cavity of a query that is inside the hull, not a vertex and not on a hull edge. `root`
/// is a triangle that contains it. The circle test is exact and strict, so it takes all or none of
/// several cocircular triangles. The cavity is therefore connected and star-shaped about the query.
template <class Kernel>
void find_cavity(const Mesh<Kernel>& mesh, const Query& p, std::uint32_t root, Cavity& cavity) {
  const Triangle* const triangle = mesh.triangle.data();
  const auto* const point = mesh.point.data();
  cavity.clear();
  const auto add_corner = [&](std::uint32_t v) {
    cavity.corner.push_back({v, to_query(point[v])});
    return static_cast<std::uint32_t>(cavity.corner.size() - 1);
  };
  const Triangle& first = triangle[root];
  for (const std::uint32_t v : first.corner) add_corner(v);
  cavity.triangle.push_back({0, 1, 2});
  if (cavity.pending.empty()) cavity.pending.resize(64);
  cavity.pending[0] = {first.mate[1], {2, 0, 0}};
  cavity.pending[1] = {first.mate[0], {1, 2, 0}};
  std::size_t depth = 2;
  Cavity::Pending current{first.mate[2], {0, 1, 0}};
  while (true) {
    const Triangle& t = triangle[triangle_of(current.side)];
    const bool inside =
        !has_ghost(t.corner) &&
        DoubleKernel::in_circle(to_query(point[t.corner[0]]), to_query(point[t.corner[1]]),
                                to_query(point[t.corner[2]]), p) > 0;
    const Cavity::Edge edge = current.edge;
    if (!inside) {
      cavity.rim.push_back(edge);
      if (depth == 0) return;
      current = cavity.pending[--depth];
      continue;
    }
    const std::uint32_t i = index_of(current.side);
    const std::uint32_t apex = add_corner(t.corner[i]);
    const auto number = static_cast<std::uint32_t>(cavity.triangle.size());
    cavity.triangle.push_back({edge.from, apex, edge.to});
    cavity.link.push_back({edge.from, edge.to, edge.triangle, number});
    // Counter-clockwise, so the edge from -> apex comes first.
    const Side later = t.mate[previous_index(i)];
    __builtin_prefetch(&triangle[triangle_of(later)]);
    if (depth == cavity.pending.size()) [[unlikely]]
      cavity.pending.resize(2 * depth);
    cavity.pending[depth++] = {later, {apex, edge.to, number}};
    current = {t.mate[next_index(i)], {edge.from, apex, number}};
  }
}

/// For a vertex inside the hull: takes its neighbours as corners, and their polygon as rim. There
/// are no triangles inside, as if the vertex were the only point in the polygon. Returns false for
/// hull vertices.
template <class Kernel>
bool find_link(const Mesh<Kernel>& mesh, std::uint32_t vertex, Cavity& cavity) {
  cavity.clear();
  bool closed = true;
  for_each_triangle_at(mesh, vertex, [&](std::uint32_t t, std::uint32_t i) {
    const std::uint32_t v = mesh.triangle[t].corner[next_index(i)];
    closed = closed && v != kGhost;
    if (!closed) return;
    const auto k = static_cast<std::uint32_t>(cavity.corner.size());
    cavity.corner.push_back({v, to_query(mesh.point[v])});
    cavity.rim.push_back({k, k + 1, 0});
  });
  if (closed) cavity.rim.back().to = 0;
  return closed;
}

}  // namespace terrace::tri::planar
