// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <queue>
#include <span>
#include <vector>

#include "../delaunay3/star.hpp"
#include "criterion.hpp"
#include "spheres.hpp"
#include "state.hpp"

/// The rules that peel tetrahedra from the hull: the flood, the return of lost vertices after it,
/// and the published rule in rounds.

namespace terrace::tri::shape {

/// The flood rule removes the tetrahedra that can be reached from beyond the hull through facets
/// that are not boundary facets as seen from the tetrahedron behind them. These steps depend on the
/// tetrahedra alone, so the reached set does not depend on the order.
///
/// Every removed tetrahedron stores the facet through which it was first reached. These facets form
/// a forest rooted beyond the hull. The update needs it to find the tetrahedra that have lost their
/// path.

/// Continues from the tetrahedra in state.queue, breadth-first so that paths are short.
template <class Criterion, class Mesh>
void spread(const Mesh& mesh, State& state, const Criterion& criterion) {
  for (std::size_t at = 0; at < state.queue.size(); ++at) {
    state.ticks(256);
    const spatial::Tetrahedron& from = mesh.tetrahedron[state.queue[at]];
    for (const spatial::Side side : from.mate) {
      const std::uint32_t t = spatial::tetrahedron_of(side);
      if (state.of[t] != kKept) continue;
      const std::uint32_t i = spatial::index_of(side);
      if (criterion.boundary(mesh, mesh.tetrahedron[t], i)) continue;
      state.remove(mesh, t, i);
      state.queue.push_back(t);
    }
  }
}

/// Removes t if it can be reached from one of its neighbours.
template <class Criterion, class Mesh>
void test_tetrahedron(const Mesh& mesh, State& state, const Criterion& criterion, std::uint32_t t) {
  const spatial::Tetrahedron& tetrahedron = mesh.tetrahedron[t];
  for (std::uint32_t i = 0; i < 4; ++i) {
    if (state.of[spatial::tetrahedron_of(tetrahedron.mate[i])] == kKept) continue;
    if (criterion.boundary(mesh, tetrahedron, i)) continue;
    state.remove(mesh, t, i);
    state.queue.push_back(t);
    return;
  }
}

template <class Criterion, class Mesh>
void flood(const Mesh& mesh, State& state, const Criterion& criterion) {
  keep_all(mesh, state);
  state.queue.clear();
  for (std::uint32_t t = 0; t < mesh.tetrahedron.size(); ++t) {
    state.ticks(16);
    const spatial::Tetrahedron& ghost = mesh.tetrahedron[t];
    if (ghost.corner[0] == spatial::kFreeCorner) continue;
    const std::uint32_t g = spatial::ghost_index(ghost.corner);
    if (g == 4) continue;
    const std::uint32_t inner = spatial::tetrahedron_of(ghost.mate[g]);
    if (state.of[inner] == kKept) test_tetrahedron(mesh, state, criterion, inner);
  }
  spread(mesh, state, criterion);
  find_lost(mesh, state);
}

/// Keeps a removed tetrahedron whose path from outside no longer exists, and all tetrahedra whose
/// paths led through it, until they are tested again.
template <class Mesh>
void take_back(const Mesh& mesh, State& state, std::uint32_t orphan) {
  const auto restore = [&](std::uint32_t t) {
    state.keep(mesh, t);
    state.pending.push_back(t);
  };
  std::size_t at = state.pending.size();
  restore(orphan);
  for (; at < state.pending.size(); ++at) {
    const std::uint32_t t = state.pending[at];
    for (const spatial::Side side : mesh.tetrahedron[t].mate)
      if (state.of[spatial::tetrahedron_of(side)] == spatial::index_of(side))
        restore(spatial::tetrahedron_of(side));
  }
}

/// Appends to state.pending the surviving tetrahedra that have gained a facet on the hull (and
/// perhaps others, which does no harm). They had a neighbour that was removed and have no new one
/// there, so their facet is a facet of removed tetrahedra only.
template <class Changes, class Mesh>
void find_exposed(const Mesh& mesh, State& state, const Changes& changes) {
  using Key = std::array<std::uint32_t, 3>;
  std::vector<Key> removed, added;
  const auto add_facets = [](std::vector<Key>& keys, const std::array<std::uint32_t, 4>& corner) {
    for (const auto& f : spatial::kFacet) {
      Key key = {corner[f[0]], corner[f[1]], corner[f[2]]};
      std::sort(key.begin(), key.end());
      keys.push_back(key);
    }
  };
  for (const auto& c : changes.removed_corners)
    add_facets(removed, {slot(c[0]), slot(c[1]), slot(c[2]), slot(c[3])});
  for (const TetrahedronId t : changes.added_tetrahedra)
    add_facets(added, mesh.tetrahedron[slot(t)].corner);
  std::sort(removed.begin(), removed.end());
  std::sort(added.begin(), added.end());
  for (std::size_t i = 0; i < removed.size(); ++i) {
    const Key& key = removed[i];
    if (i + 1 < removed.size() && removed[i + 1] == key) {
      ++i;
      continue;
    }
    if (!mesh.vertex_alive(key[0]) || std::binary_search(added.begin(), added.end(), key)) continue;
    spatial::Star star(mesh, key[0]);
    for (std::uint32_t t = star.next(); t != spatial::kNone; t = star.next()) {
      const auto& corner = mesh.tetrahedron[t].corner;
      const auto is_corner = [&](std::uint32_t v) {
        return std::find(corner.begin(), corner.end(), v) != corner.end();
      };
      if (is_corner(key[1]) && is_corner(key[2]) && !spatial::has_ghost(corner))
        state.pending.push_back(t);
    }
  }
}

/// Updates the state after changes. The result equals the state after flood(), except for the
/// paths. A removed tetrahedron stays removed if it still exists and its path did not lead through
/// one that no longer exists, because its path is still valid. All others are tested, along with
/// everything from which they could be reached, so all reachable ones are found.
template <class Criterion, class Changes, class Mesh>
void update_flood(const Mesh& mesh, State& state, const Criterion& criterion,
                  const Changes& changes) {
  state.forget_rescued();
  state.queue.clear();
  state.pending.clear();
  state.touched.clear();
  for (std::size_t k = 0; k < changes.removed_tetrahedra.size(); ++k) {
    const std::uint32_t t = slot(changes.removed_tetrahedra[k]);
    const bool was_kept = state.of[t] == kKept;
    state.kept_count -= was_kept;
    state.of[t] = kAbsent;
    for (const VertexId v : changes.removed_corners[k]) {
      state.degree[slot(v)] -= was_kept;
      state.touched.push_back(slot(v));
    }
  }
  if (mesh.flat) {
    state.lost.clear();
    return;
  }
  state.of.resize(std::max<std::size_t>(state.of.size(), mesh.tetrahedron.size()), kAbsent);
  state.degree.resize(std::max<std::size_t>(state.degree.size(), mesh.vertex.size()));
  for (const TetrahedronId id : changes.added_tetrahedra) {
    state.keep(mesh, slot(id));
    state.pending.push_back(slot(id));
  }
  // Some paths lead through tetrahedra that no longer exist. Their next step now starts at the new
  // tetrahedra, or at the hull, which is equivalent.
  for (const TetrahedronId id : changes.added_tetrahedra) {
    for (const spatial::Side side : mesh.tetrahedron[slot(id)].mate)
      if (state.of[spatial::tetrahedron_of(side)] == spatial::index_of(side))
        take_back(mesh, state, spatial::tetrahedron_of(side));
  }
  find_exposed(mesh, state, changes);
  for (const std::uint32_t t : state.pending)
    if (state.of[t] == kKept) test_tetrahedron(mesh, state, criterion, t);
  spread(mesh, state, criterion);

  // Degrees increased only at pending tetrahedra, and decreased only at those in the queue.
  for (const std::uint32_t v : state.lost) state.touched.push_back(v);
  for (const std::uint32_t t : state.queue)
    for (const std::uint32_t v : mesh.tetrahedron[t].corner) state.touched.push_back(v);
  std::sort(state.touched.begin(), state.touched.end());
  state.touched.erase(std::unique(state.touched.begin(), state.touched.end()), state.touched.end());
  state.lost.clear();
  for (const std::uint32_t v : state.touched)
    if (state.degree[v] == 0 && mesh.vertex_alive(v)) state.lost.push_back(v);
}

/// Puts tetrahedra back until every vertex has one. A literal guard, "do not remove the last
/// tetrahedron of a vertex", would make the flood depend on its order: it would remove the first of
/// two tetrahedra at a vertex that it meets. The flood therefore runs to its end, which does not
/// depend on the order, and the lost tetrahedra return in an order given by the coordinates alone.
///
/// Only tetrahedra with a vertex that has none are put back. Each of them gives a tetrahedron to
/// such a vertex, and every vertex is in some tetrahedron, so this ends with no vertex lost. Each
/// step chooses the first in a total order of a set that the previous steps determine. The result
/// is therefore determined by the result of the flood, the tetrahedra and their coordinates.

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
  constexpr std::uint32_t kRestoredFlag = 0x80000000u;
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
  std::vector<RescueKey> isolated;  // candidates without a kept neighbour, used last
  std::size_t at = 0;
  const auto keep_rescued = [&](std::uint32_t t) {
    state.of[t] |= kRescuedBit;
    state.rescued.push_back(t);
    for (const std::uint32_t v : mesh.tetrahedron[t].corner)
      if (state.degree[v] == 0) state.degree[v] = kRestoredFlag;
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
      if (has_lost(t)) keep_rescued(t);
    }
    if (isolated.empty()) {
      each_with_lost([&](std::uint32_t t) { isolated.push_back(rescue_key(mesh, t)); });
      std::sort(isolated.begin(), isolated.end(),
                [&](const RescueKey& a, const RescueKey& b) { return later(b, a); });
    }
    while (at < isolated.size() && !has_lost(isolated[at].tetrahedron)) ++at;
    if (at == isolated.size()) break;
    keep_rescued(isolated[at].tetrahedron);
  }
  for (const std::uint32_t v : state.lost) state.degree[v] = 0;
}

/// The published rule, in rounds, see ShapeRule::published.
template <class Criterion, class Mesh>
void peel_as_published(const Mesh& mesh, State& state, const Criterion& criterion,
                       bool keep_vertices) {
  keep_all(mesh, state);
  const std::vector<std::uint32_t> order = sorted_vertices(mesh);
  std::vector<std::uint32_t> rank(mesh.vertex.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) rank[order[i]] = i;
  struct Candidate {
    std::array<std::uint32_t, 4> key;
    std::uint32_t tetrahedron;
  };
  std::vector<Candidate> round, next;
  const auto add = [&](std::vector<Candidate>& to, std::uint32_t t) {
    Candidate candidate{{}, t};
    for (std::size_t i = 0; i < 4; ++i) candidate.key[i] = rank[mesh.tetrahedron[t].corner[i]];
    std::sort(candidate.key.begin(), candidate.key.end());
    to.push_back(candidate);
  };
  const auto open = [&](spatial::Side side) {
    return state.of[spatial::tetrahedron_of(side)] != kKept;
  };
  for (std::uint32_t t = 0; t < mesh.tetrahedron.size(); ++t) {
    if (state.of[t] != kKept) continue;
    const auto& mate = mesh.tetrahedron[t].mate;
    if (std::any_of(mate.begin(), mate.end(), open)) add(round, t);
  }
  while (!round.empty()) {
    std::sort(round.begin(), round.end(), [&](const Candidate& a, const Candidate& b) {
      state.ticks(8);
      return a.key < b.key;
    });
    next.clear();
    std::uint32_t previous = spatial::kNone;
    for (const Candidate& candidate : round) {
      state.ticks(128);
      const std::uint32_t t = candidate.tetrahedron;
      if (t == previous || state.of[t] != kKept) continue;
      previous = t;
      const spatial::Tetrahedron& tetrahedron = mesh.tetrahedron[t];
      bool stays = false;
      for (std::uint32_t i = 0; i < 4 && !stays; ++i)
        stays = open(tetrahedron.mate[i]) && criterion.boundary(mesh, tetrahedron, i);
      if (stays) continue;
      if (keep_vertices) {
        for (const std::uint32_t v : tetrahedron.corner) stays = stays || state.degree[v] == 1;
        if (stays) continue;
      }
      state.remove(mesh, t, 0);
      for (const spatial::Side side : tetrahedron.mate)
        if (!open(side)) add(next, spatial::tetrahedron_of(side));
    }
    std::swap(round, next);
  }
  find_lost(mesh, state);
}

}  // namespace terrace::tri::shape
