// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "../delaunay3/star.hpp"
#include "state.hpp"

/// The flood rule removes the tetrahedra that can be reached from beyond the hull through facets
/// that are not boundary facets as seen from the tetrahedron behind them. These steps depend on the
/// tetrahedra alone, so the reached set does not depend on the order.
///
/// Every removed tetrahedron stores the facet through which it was first reached. These facets form
/// a forest rooted beyond the hull. The update needs it to find the tetrahedra that have lost their
/// path.

namespace terrace::tri::shape {

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
void judge(const Mesh& mesh, State& state, const Criterion& criterion, std::uint32_t t) {
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
    if (state.of[inner] == kKept) judge(mesh, state, criterion, inner);
  }
  spread(mesh, state, criterion);
  find_lost(mesh, state);
}

/// Keeps a removed tetrahedron whose path from outside no longer exists, and all tetrahedra whose
/// paths led through it, until they are tested again.
template <class Mesh>
void take_back(const Mesh& mesh, State& state, std::uint32_t orphan) {
  const auto back = [&](std::uint32_t t) {
    state.keep(mesh, t);
    state.pending.push_back(t);
  };
  std::size_t at = state.pending.size();
  back(orphan);
  for (; at < state.pending.size(); ++at) {
    const std::uint32_t t = state.pending[at];
    for (const spatial::Side side : mesh.tetrahedron[t].mate)
      if (state.of[spatial::tetrahedron_of(side)] == spatial::index_of(side))
        back(spatial::tetrahedron_of(side));
  }
}

/// Appends to state.pending the surviving tetrahedra that have gained a facet on the hull (and
/// perhaps others, which does no harm). They had a neighbour that was removed and have no new one
/// there, so their facet is a facet of removed tetrahedra only.
template <class Changes, class Mesh>
void find_exposed(const Mesh& mesh, State& state, const Changes& changes) {
  using Key = std::array<std::uint32_t, 3>;
  std::vector<Key> gone, added;
  const auto add_facets = [](std::vector<Key>& keys, const std::array<std::uint32_t, 4>& corner) {
    for (const auto& f : spatial::kFacet) {
      Key key = {corner[f[0]], corner[f[1]], corner[f[2]]};
      std::sort(key.begin(), key.end());
      keys.push_back(key);
    }
  };
  for (const auto& c : changes.removed_corners)
    add_facets(gone, {slot(c[0]), slot(c[1]), slot(c[2]), slot(c[3])});
  for (const TetrahedronId t : changes.added_tetrahedra)
    add_facets(added, mesh.tetrahedron[slot(t)].corner);
  std::sort(gone.begin(), gone.end());
  std::sort(added.begin(), added.end());
  for (std::size_t i = 0; i < gone.size(); ++i) {
    const Key& key = gone[i];
    if (i + 1 < gone.size() && gone[i + 1] == key) {
      ++i;
      continue;
    }
    if (!mesh.vertex_alive(key[0]) || std::binary_search(added.begin(), added.end(), key)) continue;
    spatial::Star star(mesh, key[0]);
    for (std::uint32_t t = star.next(); t != spatial::kNone; t = star.next()) {
      const auto& corner = mesh.tetrahedron[t].corner;
      const auto has = [&](std::uint32_t v) {
        return std::find(corner.begin(), corner.end(), v) != corner.end();
      };
      if (has(key[1]) && has(key[2]) && !spatial::has_ghost(corner)) state.pending.push_back(t);
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
    if (state.of[t] == kKept) judge(mesh, state, criterion, t);
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

}  // namespace terrace::tri::shape
