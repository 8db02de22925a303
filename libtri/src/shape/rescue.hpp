// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <queue>
#include <vector>

#include "../delaunay3/star.hpp"
#include "criterion.hpp"
#include "state.hpp"

/// Puts tetrahedra back until every vertex has one. A literal guard, "do not remove the last
/// tetrahedron of a vertex", would make the flood depend on its order: it would remove the first of
/// two tetrahedra at a vertex that it meets. The flood therefore runs to its end, which does not
/// depend on the order, and the lost tetrahedra return in an order given by the coordinates alone.
///
/// Only tetrahedra with a vertex that has none are put back. Each of them gives a tetrahedron to
/// such a vertex, and every vertex is in some tetrahedron, so this ends with no vertex lost. Each
/// step chooses the first in a total order of a set that the previous steps determine. The result
/// is therefore determined by the result of the flood, the tetrahedra and their coordinates.

namespace terrace::tri::shape {

/// Sorts tetrahedra by their longest edge, then lexicographically by their sorted corners. Lengths
/// whose squares overflow or underflow count as equal.
struct RescueKey {
  double longest2;
  std::array<std::uint32_t, 4> corner;  ///< sorted by coordinates
  std::uint32_t tetrahedron;
};

template <class Mesh>
RescueKey rescue_key(const Mesh& mesh, std::uint32_t t) {
  RescueKey key{0.0, mesh.tetrahedron[t].corner, t};
  std::sort(key.corner.begin(), key.corner.end(), [&](std::uint32_t a, std::uint32_t b) {
    return spatial::lexicographically_less(mesh.vertex[a].point, mesh.vertex[b].point);
  });
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3 p = to_doubles(mesh.vertex[key.corner[i]].point);
    for (std::size_t j = i + 1; j < 4; ++j) {
      const Vector3 d = edge(mesh, to_doubles(mesh.vertex[key.corner[j]].point), p);
      key.longest2 = std::max(key.longest2, dot(d, d));
    }
  }
  return key;
}

template <class Mesh>
void rescue(const Mesh& mesh, State& state) {
  if (state.lost.empty()) return;
  const auto later = [&](const RescueKey& a, const RescueKey& b) {
    if (a.longest2 != b.longest2) return a.longest2 > b.longest2;
    for (std::size_t i = 0; i < 4; ++i)
      if (a.corner[i] != b.corner[i])
        return spatial::lexicographically_less(mesh.vertex[b.corner[i]].point,
                                               mesh.vertex[a.corner[i]].point);
    return false;
  };
  // Added to the degree of a lost vertex once it has a tetrahedron again, until the end.
  constexpr std::uint32_t kOnce = 0x80000000u;
  const auto has_lost = [&](std::uint32_t t) {
    for (const std::uint32_t v : mesh.tetrahedron[t].corner)
      if (state.degree[v] == 0) return true;
    return false;
  };
  const auto finite_removed = [&](std::uint32_t t) { return is_removed(state.of[t]); };

  const auto each_with_lost = [&](const auto& visit) {
    for (const std::uint32_t v : state.lost) {
      if (state.degree[v] != 0) continue;
      spatial::Star star(mesh, v);
      for (std::uint32_t t = star.next(); t != spatial::kNone; t = star.next())
        if (finite_removed(t)) visit(t);
    }
  };
  std::priority_queue<RescueKey, std::vector<RescueKey>, decltype(later)> next(later);
  each_with_lost([&](std::uint32_t t) {
    for (const spatial::Side side : mesh.tetrahedron[t].mate) {
      if (state.of[spatial::tetrahedron_of(side)] != kKept) continue;
      next.push(rescue_key(mesh, t));
      break;
    }
  });
  std::vector<RescueKey> rest;  // candidates without a kept neighbour, used last
  std::size_t at = 0;
  const auto take = [&](std::uint32_t t) {
    state.of[t] |= kRescuedBit;
    state.rescued.push_back(t);
    for (const std::uint32_t v : mesh.tetrahedron[t].corner)
      if (state.degree[v] == 0) state.degree[v] = kOnce;
    for (const spatial::Side side : mesh.tetrahedron[t].mate) {
      const std::uint32_t n = spatial::tetrahedron_of(side);
      if (finite_removed(n) && has_lost(n)) next.push(rescue_key(mesh, n));
    }
  };
  for (;;) {
    while (!next.empty()) {
      state.ticks(256);
      const std::uint32_t t = next.top().tetrahedron;
      next.pop();
      if (has_lost(t)) take(t);
    }
    if (rest.empty()) {
      each_with_lost([&](std::uint32_t t) { rest.push_back(rescue_key(mesh, t)); });
      std::sort(rest.begin(), rest.end(),
                [&](const RescueKey& a, const RescueKey& b) { return later(b, a); });
    }
    while (at < rest.size() && !has_lost(rest[at].tetrahedron)) ++at;
    if (at == rest.size()) break;
    take(rest[at].tetrahedron);
  }
  for (const std::uint32_t v : state.lost) state.degree[v] = 0;
}

}  // namespace terrace::tri::shape
