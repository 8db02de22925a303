// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <terrace/base/union_find.hpp>

#include "gabriel.hpp"
#include "state.hpp"

/// The surface of the kept tetrahedra, and its parts, which are separated by the tetrahedra inside.

namespace terrace::tri::shape {

/// Implements BasicShape3::surface().
template <class Mesh>
ShapeSurface surface_of(const Mesh& mesh, const State& state) {
  const auto& of = state.of;
  ShapeSurface result;
  std::vector<std::array<std::uint32_t, 3>>& faces = result.surface.faces;
  constexpr std::uint32_t kUnused = spatial::kNone;
  std::vector<std::uint32_t> number(mesh.vertex.size(), kUnused);
  for (std::uint32_t t = 0; t < of.size(); ++t) {
    if (!is_kept(of[t])) continue;
    const spatial::Tetrahedron& tetrahedron = mesh.tetrahedron[t];
    for (std::uint32_t i = 0; i < 4; ++i) {
      if (is_kept(of[spatial::tetrahedron_of(tetrahedron.mate[i])])) continue;
      // In order with the corner first, so counter-clockwise seen from the other side.
      faces.push_back(spatial::facet_of(tetrahedron, i));
      result.tetrahedra.push_back(TetrahedronId{t});
      for (const std::uint32_t v : faces.back()) number[v] = 0;
    }
  }
  for (std::uint32_t v = 0; v < number.size(); ++v) {
    if (number[v] == kUnused) continue;
    number[v] = static_cast<std::uint32_t>(result.vertices.size());
    result.vertices.push_back(VertexId{v});
    result.surface.points.push_back(to_doubles(mesh.vertex[v].point));
  }
  for (auto& face : faces)
    for (std::uint32_t& v : face) v = number[v];
  return result;
}

/// Components and Euler characteristic of a surface of the kept tetrahedra, some of whose faces may
/// have been left out. Vertices are repeated where the surface touches itself: an edge joins the
/// two faces that bound the same inside at it, and a vertex joins the faces that such edges join.
/// O(slots).
template <class Mesh>
ShapeParts parts_apart(const Mesh& mesh, const State& state, const ShapeSurface& surface) {
  const auto inside = [&](std::uint32_t t) { return is_kept(state.of[t]); };
  const std::size_t faces = surface.surface.faces.size();
  std::vector<spatial::Side> sides(faces);
  constexpr std::uint32_t kNoFace = spatial::kNone;
  std::vector<std::uint32_t> number(state.of.size(), kNoFace);  // of a tetrahedron's first face
  for (std::uint32_t f = 0; f < faces; ++f) {
    const std::uint32_t t = slot(surface.tetrahedra[f]);
    std::uint32_t i = 0;
    const auto on_face = [&](std::uint32_t v) {
      const auto& face = surface.surface.faces[f];
      return std::any_of(face.begin(), face.end(),
                         [&](std::uint32_t p) { return slot(surface.vertices[p]) == v; });
    };
    while (i < 3 && on_face(mesh.tetrahedron[t].corner[i])) ++i;
    sides[f] = spatial::make_side(t, i);
    number[t] = std::min(number[t], f);
  }
  const auto face_of = [&](spatial::Side side) {
    const std::uint32_t t = spatial::tetrahedron_of(side);
    for (std::uint32_t f = number[t]; f < faces && spatial::tetrahedron_of(sides[f]) == t; ++f)
      if (sides[f] == side) return f;
    return kNoFace;
  };
  // Corners of faces that belong to the same vertex, as disjoint sets.
  base::UnionFind corners(3 * faces), parts(faces);
  const auto corner_of = [&](std::uint32_t face, std::uint32_t vertex) {
    const auto f = spatial::facet_of(mesh.tetrahedron[spatial::tetrahedron_of(sides[face])],
                                     spatial::index_of(sides[face]));
    return 3 * face + (f[0] == vertex ? 0u : f[1] == vertex ? 1u : 2u);
  };
  std::size_t shared = 0;  // edges of two faces, counted from both sides
  for (std::uint32_t face = 0; face < faces; ++face) {
    const std::uint32_t first = spatial::tetrahedron_of(sides[face]);
    const auto f = spatial::facet_of(mesh.tetrahedron[first], spatial::index_of(sides[face]));
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t p = f[k], q = f[(k + 1) % 3];
      // Walks around the edge through the inside, leaving t opposite to the corner that is not on
      // the facet.
      std::uint32_t t = first, from = spatial::index_of(sides[face]);
      for (;;) {
        const auto& corner = mesh.tetrahedron[t].corner;
        std::uint32_t to = 0;
        while (to == from || corner[to] == p || corner[to] == q) ++to;
        const spatial::Side mate = mesh.tetrahedron[t].mate[to];
        if (!inside(spatial::tetrahedron_of(mate))) {
          const std::uint32_t other = face_of(spatial::make_side(t, to));
          if (other == kNoFace) break;
          ++shared;
          parts.unite(face, other);
          corners.unite(corner_of(face, p), corner_of(other, p));
          corners.unite(corner_of(face, q), corner_of(other, q));
          break;
        }
        t = spatial::tetrahedron_of(mate);
        from = spatial::index_of(mate);
      }
    }
  }
  const auto edges = static_cast<std::int64_t>(3 * faces - shared / 2);
  return {parts.sets(),
          static_cast<std::int64_t>(corners.sets()) - edges + static_cast<std::int64_t>(faces)};
}

}  // namespace terrace::tri::shape
