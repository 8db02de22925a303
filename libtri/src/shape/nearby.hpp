// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "poles.hpp"

/// Applies the poles rule after a local change, see BasicShape3::update_nearby().

namespace terrace::tri::shape {

/// True if most of the new tetrahedra are far from the surface, see label_far_tetrahedra(): where
/// fine detail ends, a few points have tetrahedra with thousands of the fine points on the other
/// side of a body.
template <class Changes>
bool reaches_far(const Changes& changes) {
  return changes.added_tetrahedra.size() > 900 + 8 * changes.added_vertices.size();
}

/// The tetrahedra around a change as a separate triangulation in local numbers. New tetrahedra and
/// their neighbours come first, and their labels are computed. All others that share a vertex with
/// one of them follow, and their labels are known.
template <class Mesh>
class LocalUpdate {
 public:
  LocalUpdate(const Mesh& mesh, State& state) : mesh_(mesh), state_(state) {
    const auto extend_with_none = [](Pool<std::uint32_t>& numbers, std::uint32_t size) {
      const std::uint32_t old_size = numbers.size();
      if (size <= old_size) return;
      numbers.resize(size);
      std::fill(numbers.data() + old_size, numbers.data() + size, spatial::kNone);
    };
    extend_with_none(state.local_tetrahedron, mesh.tetrahedron.size());
    extend_with_none(state.local_vertex, mesh.vertex.size());
  }
  ~LocalUpdate() {
    for (const auto* list : {&slots_, &examined_})
      for (const std::uint32_t t : *list) state_.local_tetrahedron[t] = spatial::kNone;
    for (const std::uint32_t v : vertices_) state_.local_vertex[v] = spatial::kNone;
  }
  LocalUpdate(const LocalUpdate&) = delete;
  LocalUpdate& operator=(const LocalUpdate&) = delete;

  /// unlabelled: the new tetrahedra that label_far_tetrahedra() has not labelled.
  template <class Changes>
  void relabel(const Changes& changes, std::span<const TetrahedronId> unlabelled) {
    collect(changes, unlabelled);
    number_vertices();
    number_tetrahedra();
    const Spheres spheres(tetrahedra_, local_places(), 1);
    std::vector<std::uint8_t> labels(tetrahedra_.size());
    for (std::size_t i = unlabelled_count_; i < slots_.size(); ++i)
      labels[i] = static_cast<std::uint8_t>(1 + state_.forest[slots_[i]]);
    const Part part{labels, unlabelled_count_, is_complete_};
    std::vector<std::uint8_t> inside = signed_forest(spheres, 1, part);
    for (std::uint32_t i = 0; i < slots_.size(); ++i) {
      if (i < unlabelled_count_) state_.forest[slots_[i]] = inside[i];
      // Where nothing will be flipped, keeps the labels after earlier flips.
      if (!has_complete_corners(tetrahedra_[i])) inside[i] = state_.of[slots_[i]] == kKept;
    }
    smooth_and_sculpt(spheres, inside, part);
    write(inside);
  }
  /// Returns, by slot, all tetrahedra whose label or whose neighbours may have changed: those
  /// examined, the new ones and their neighbours, and those exposed. Must be called last.
  template <class Changes>
  std::vector<std::uint32_t> examined(const Changes& changes,
                                      std::span<const std::uint32_t> exposed) {
    examined_ = slots_;
    const auto add_examined = [&](std::uint32_t t) {
      if (std::exchange(state_.local_tetrahedron[t], 0) == spatial::kNone) examined_.push_back(t);
    };
    for (const TetrahedronId t : changes.added_tetrahedra) {
      add_examined(slot(t));
      for (const spatial::Side mate : mesh_.tetrahedron[slot(t)].mate)
        add_examined(spatial::tetrahedron_of(mate));
    }
    for (const std::uint32_t t : exposed) add_examined(t);
    return examined_;
  }
  [[nodiscard]] const std::vector<std::uint32_t>& slots() const { return slots_; }

 private:
  void collect_tetrahedron(std::uint32_t t) {
    if (state_.local_tetrahedron[t] != spatial::kNone) return;
    state_.local_tetrahedron[t] = static_cast<std::uint32_t>(slots_.size());
    slots_.push_back(t);
    __builtin_prefetch(&mesh_.tetrahedron[t]);
  }
  template <class Changes>
  void collect(const Changes& changes, std::span<const TetrahedronId> unlabelled) {
    const auto finite = [&](std::uint32_t t) {
      return spatial::is_finite(mesh_.tetrahedron[t].corner);
    };
    for (const TetrahedronId id : unlabelled) collect_tetrahedron(slot(id));
    const std::size_t new_count = slots_.size();
    for (std::size_t i = 0; i < new_count; ++i)
      for (const spatial::Side mate : mesh_.tetrahedron[slots_[i]].mate)
        if (finite(spatial::tetrahedron_of(mate)))
          collect_tetrahedron(spatial::tetrahedron_of(mate));
    unlabelled_count_ = slots_.size();
    const auto add = [&](std::uint32_t v) {
      if (state_.local_vertex[v] != spatial::kNone) return;
      state_.local_vertex[v] = static_cast<std::uint32_t>(vertices_.size());
      vertices_.push_back(v);
    };
    for (std::size_t i = 0; i < unlabelled_count_; ++i)
      for (const std::uint32_t v : mesh_.tetrahedron[slots_[i]].corner) add(v);
    // Vertices at the hull may have lost tetrahedra and gained none. Vertices at which only
    // tetrahedra of one label were exchanged need not be examined.
    for (const auto& corners : changes.removed_corners) {
      for (const VertexId v : corners) {
        if (!mesh_.vertex_alive(slot(v))) continue;
        if (const auto labels = state_.removed_labels[slot(v)]; labels == 1 || labels == 2)
          continue;
        add(slot(v));
        collect_tetrahedron(mesh_.vertex[slot(v)].incident);
      }
    }
    // Takes all tetrahedra at these vertices, including ghosts. They are connected with those
    // listed through facets that have such a corner.
    tetrahedra_.reserve(4 * slots_.size());
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      const spatial::Tetrahedron& t = tetrahedra_.emplace_back(mesh_.tetrahedron[slots_[i]]);
      std::array<bool, 4> at_vertex{};
      int count = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        const std::uint32_t v = t.corner[k];
        at_vertex[k] = v != spatial::kGhost && state_.local_vertex[v] != spatial::kNone;
        count += at_vertex[k];
      }
      for (std::size_t k = 0; k < 4; ++k)
        if (count > at_vertex[k]) collect_tetrahedron(spatial::tetrahedron_of(t.mate[k]));
    }
  }
  /// Numbers the vertices in lexicographic order, from 1.
  void number_vertices() {
    const std::size_t complete_count = vertices_.size();
    for (const spatial::Tetrahedron& t : tetrahedra_) {
      for (const std::uint32_t v : t.corner) {
        if (v == spatial::kGhost || state_.local_vertex[v] != spatial::kNone) continue;
        state_.local_vertex[v] = static_cast<std::uint32_t>(vertices_.size());
        vertices_.push_back(v);
      }
    }
    std::vector<std::uint32_t> order = vertices_;
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return spatial::lexicographically_less(mesh_.vertex[a].point, mesh_.vertex[b].point);
    });
    is_complete_.assign(order.size() + 1, 0);
    for (std::uint32_t i = 0; i < order.size(); ++i) {
      is_complete_[i + 1] = state_.local_vertex[order[i]] < complete_count;
      state_.local_vertex[order[i]] = i + 1;
    }
    vertices_ = std::move(order);
  }
  std::vector<Place> local_places() const {
    std::vector<Place> places = places_of(mesh_, std::span<const std::uint32_t>(vertices_));
    places.insert(places.begin(), kGhostPlace);
    return places;
  }
  /// Turns the tetrahedra and gives them local numbers. After the last one follows a slot that is
  /// not finite, the neighbour of tetrahedra at the border of this part.
  void number_tetrahedra() {
    const auto outside = static_cast<std::uint32_t>(slots_.size());
    std::vector<std::uint8_t> turns;
    turns.reserve(slots_.size());
    for (spatial::Tetrahedron& t : tetrahedra_) {
      for (std::uint32_t& v : t.corner)
        if (v != spatial::kGhost) v = state_.local_vertex[v];
      // Local numbers are already ranks. The ghost's number, 0, wraps round to the last rank.
      turns.push_back(turn_of(t.corner, [](std::uint32_t v) { return v - 1; }));
    }
    const auto new_side = [&](spatial::Side mate) {
      const std::uint32_t other = state_.local_tetrahedron[spatial::tetrahedron_of(mate)];
      return other == spatial::kNone
                 ? spatial::make_side(outside, 0)
                 : spatial::make_side(other, kTurns[turns[other]].to[spatial::index_of(mate)]);
    };
    for (std::size_t n = 0; n < turns.size(); ++n)
      tetrahedra_[n] = rotate_corners(tetrahedra_[n], kTurns[turns[n]], new_side);
    tetrahedra_.emplace_back().corner.fill(spatial::kFreeCorner);
  }
  [[nodiscard]] bool has_complete_corners(const spatial::Tetrahedron& t) const {
    return spatial::is_finite(t.corner) &&
           std::all_of(t.corner.begin(), t.corner.end(),
                       [&](std::uint32_t v) { return is_complete_[v] != 0; });
  }

  void write(const std::vector<std::uint8_t>& inside) {
    std::vector<std::array<bool, 2>> has(is_complete_.size());  // outside, inside
    for (std::uint32_t i = 0; i < slots_.size(); ++i) {
      for (const std::uint32_t v : tetrahedra_[i].corner) has[v][inside[i]] = true;
      if (!spatial::is_finite(tetrahedra_[i].corner)) continue;
      const bool was_inside = state_.of[slots_[i]] == kKept;
      if (inside[i] != 0 && !was_inside) state_.keep(mesh_, slots_[i]);
      if (inside[i] == 0 && was_inside) state_.remove(mesh_, slots_[i], 0);
      if (inside[i] == 0) state_.of[slots_[i]] = 0;
    }
    std::erase_if(state_.lost, [&](std::uint32_t v) {
      const std::uint32_t local = state_.local_vertex[v];
      return !mesh_.vertex_alive(v) || (local != spatial::kNone && is_complete_[local] != 0);
    });
    for (std::uint32_t i = 0; i < vertices_.size(); ++i)
      if (is_complete_[i + 1] != 0 && !(has[i + 1][0] && has[i + 1][1]))
        state_.lost.push_back(vertices_[i]);
    std::sort(state_.lost.begin(), state_.lost.end());
  }

  const Mesh& mesh_;
  State& state_;
  std::vector<std::uint32_t> slots_;              ///< tetrahedron slots, by local number
  std::vector<spatial::Tetrahedron> tetrahedra_;  ///< by local number
  std::vector<std::uint32_t> examined_;           ///< see examined()
  std::size_t unlabelled_count_ = 0;              ///< number of tetrahedra to label
  std::vector<std::uint32_t> vertices_;           ///< slots, by local number - 1
  std::vector<std::uint8_t> is_complete_;         ///< by local vertex: all its tetrahedra are here
};

/// True if update_nearby() can follow the changes and costs less than starting from scratch.
template <class Changes, class Mesh>
bool worth_updating(const Mesh& mesh, const State& state, const Changes& changes) {
  return !state.forest.empty() && 2 * changes.added_tetrahedra.size() < mesh.finite_count;
}

/// Labels the new tetrahedra that are clearly far from the surface: those with at least three
/// corners at which only tetrahedra of one label were removed, whose place they take. Returns the
/// others. Near the surface a single such corner would not be sufficient evidence.
template <class Mesh>
std::vector<TetrahedronId> label_far_tetrahedra(const Mesh& mesh, State& state,
                                                std::span<const TetrahedronId> added) {
  std::vector<TetrahedronId> others;
  for (const TetrahedronId id : added) {
    const std::uint32_t t = slot(id);
    unsigned outside = 0, inside = 0;
    for (const std::uint32_t v : mesh.tetrahedron[t].corner) {
      outside += state.removed_labels[v] == 1;
      inside += state.removed_labels[v] == 2;
    }
    if ((outside < 3 || inside > 0) && (inside < 3 || outside > 0)) {
      others.push_back(id);
      continue;
    }
    state.forest[t] = inside > 0;
    state.of[t] = 0;
    if (inside > 0) state.keep(mesh, t);
  }
  return others;
}

/// Updates the state of the poles rule after changes. `forest` has the labels before. exposed:
/// tetrahedra, by slot, that may have gained a facet on the hull. Returns, by slot, all tetrahedra
/// whose label or whose neighbours may have changed, including these. Requires a scope of the
/// metric.
template <class Changes, class Mesh>
std::vector<std::uint32_t> update_nearby(const Mesh& mesh, State& state, const Changes& changes,
                                         std::span<const std::uint32_t> exposed = {}) {
  const bool are_far = reaches_far(changes);
  state.removed_labels.resize(
      std::max<std::size_t>(state.removed_labels.size(), mesh.vertex.size()));
  for (std::size_t k = 0; k < changes.removed_tetrahedra.size(); ++k) {
    const std::uint32_t t = slot(changes.removed_tetrahedra[k]);
    const bool kept = state.of[t] == kKept;
    // A label that a flip has changed counts as both.
    const std::uint8_t bits = kept != (state.forest[t] != 0) ? 3 : kept ? 2 : 1;
    for (const VertexId v : changes.removed_corners[k])
      state.removed_labels[slot(v)] |= are_far ? bits : std::uint8_t{3};
    if (kept) {
      --state.kept_count;
      for (const VertexId v : changes.removed_corners[k]) --state.degree[slot(v)];
    }
    state.of[t] = kAbsent;
  }
  state.of.resize(std::max<std::size_t>(state.of.size(), mesh.tetrahedron.size()), kAbsent);
  state.forest.resize(state.of.size());
  state.degree.resize(std::max<std::size_t>(state.degree.size(), mesh.vertex.size()));
  // Drops the bits of a vertex that had the slot before.
  for (const VertexId v : changes.added_vertices) state.removed_labels[slot(v)] = 0;
  std::vector<TetrahedronId> others;
  std::span<const TetrahedronId> unlabelled = changes.added_tetrahedra;
  if (are_far) unlabelled = others = label_far_tetrahedra(mesh, state, unlabelled);
  LocalUpdate<Mesh> nearby(mesh, state);
  nearby.relabel(changes, unlabelled);
  for (const auto& corners : changes.removed_corners)
    for (const VertexId v : corners) state.removed_labels[slot(v)] = 0;
  return nearby.examined(changes, exposed);
}

}  // namespace terrace::tri::shape
