// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "walk.hpp"

/// Inserts one vertex into the cavity of Bowyer and Watson, found breadth-first. Each tetrahedron
/// is tested only once because the tested and kept ones are marked too. All neighbours of a
/// tetrahedron are tested before any result is used, so that mispredicted branches do not wait for
/// arithmetic. About 20 tetrahedra are replaced by 26.

namespace terrace::tri::spatial {

template <class Kernel, class Part>
class CavityInsertion {
 public:
  CavityInsertion(Mesh<Kernel>& mesh, Cavity& cavity, Part& part)
      : mesh_(mesh), cavity_(cavity), part_(part) {}

  /// Returns false, having changed nothing, if the cavity meets tetrahedra outside the part or the
  /// part is out of room.
  bool run(std::uint32_t vertex, std::uint32_t conflict) {
    bool possible = collect(mesh_.vertex[vertex].point, conflict);
    if constexpr (!Part::kIsEntireMesh) {
      out_of_room_ = possible && !part_.has_room(facet_count_);
      possible = possible && !out_of_room_;
    }
    if (possible) {
      take_slots();
      if (facet_count_ <= Cavity::kSmall) {
        fill_small(vertex);
      } else {
        fill_large(vertex);
      }
    }
    for (std::size_t i = 0; i < inside_count_; ++i) mesh_.mark[cavity_.inside[i]] = kUnknown;
    for (std::size_t i = 0; i < facet_count_; ++i)
      mesh_.mark[tetrahedron_of(cavity_.facets[i].outer)] = kUnknown;
    return possible;
  }
  [[nodiscard]] bool out_of_room() const { return out_of_room_; }

 private:
  bool collect(const typename Kernel::Point& p, std::uint32_t conflict) {
    const Tetrahedron* const tetrahedron = mesh_.tetrahedron.data();
    std::uint8_t* const mark = mesh_.mark.data();
    const Conflicts<Kernel> conflicts(mesh_, p);
    inside_count_ = 0;
    facet_count_ = 0;
    if constexpr (!Part::kIsEntireMesh) {
      if (!part_.owns(tetrahedron[conflict])) return false;
    }
    if (cavity_.inside.size() < 5) cavity_.inside.resize(64);
    if (cavity_.facets.size() < 4) cavity_.facets.resize(64);
    cavity_.inside[inside_count_++] = conflict;
    mark[conflict] = kCollected;
    for (std::size_t k = 0; k < inside_count_; ++k) {
      if (inside_count_ + 4 > cavity_.inside.size()) [[unlikely]]
        cavity_.inside.resize(2 * cavity_.inside.size());
      if (facet_count_ + 4 > cavity_.facets.size()) [[unlikely]]
        cavity_.facets.resize(2 * cavity_.facets.size());
      const Tetrahedron& t = tetrahedron[cavity_.inside[k]];
      std::array<Verdict, 4> filtered;
      for (std::uint32_t i = 0; i < 4; ++i) {
        const std::uint32_t other = tetrahedron_of(t.mate[i]);
        if constexpr (!Part::kIsEntireMesh) {
          // The other corners belong to t, which the part owns.
          if (!part_.owns(tetrahedron[other].corner[index_of(t.mate[i])])) return false;
        }
        filtered[i] = mark[other] == kUnknown ? conflicts.filter(tetrahedron[other]) : Verdict::out;
      }
      for (std::uint32_t i = 0; i < 4; ++i) {
        const std::uint32_t other = tetrahedron_of(t.mate[i]);
        // Reads the mark again, as a neighbour may occur twice.
        if (mark[other] == kUnknown) {
          const Tetrahedron& tested = tetrahedron[other];
          if (filtered[i] == Verdict::in ||
              (filtered[i] == Verdict::open && conflicts.decide(tested))) {
            mark[other] = kCollected;
            cavity_.inside[inside_count_++] = other;
            for (const Side mate : tested.mate) {
              __builtin_prefetch(&tetrahedron[tetrahedron_of(mate)]);
              __builtin_prefetch(&mark[tetrahedron_of(mate)]);
            }
            continue;
          }
          mark[other] = kKept;
        }
        if (mark[other] == kKept) {
          Cavity::Facet& facet = cavity_.facets[facet_count_++];
          facet.corner = facet_of(t, i);
          facet.outer = t.mate[i];
        }
      }
    }
    return true;
  }

  /// Reuses the slots of the cavity, and allocates more or frees the rest.
  void take_slots() {
    std::uint32_t ghosts = 0;
    for (std::size_t i = 0; i < inside_count_; ++i) {
      const std::uint32_t t = cavity_.inside[i];
      if (has_ghost(mesh_.tetrahedron[t].corner)) ++ghosts;
      mesh_.record(t);
    }
    part_.count(mesh_, ghosts, -static_cast<std::int64_t>(inside_count_));
    for (std::size_t i = 0; i < facet_count_; ++i)
      cavity_.facets[i].slot = i < inside_count_ ? cavity_.inside[i] : part_.new_tetrahedron(mesh_);
    for (std::size_t i = facet_count_; i < inside_count_; ++i)
      part_.free_tetrahedron(mesh_, cavity_.inside[i]);
  }

  /// Writes the tetrahedron on a facet and numbers the facet's corners.
  void write(std::uint32_t vertex, Cavity::Facet& facet) {
    Tetrahedron& t = mesh_.tetrahedron[facet.slot];
    t.corner = {vertex, facet.corner[0], facet.corner[1], facet.corner[2]};
    t.mate[0] = facet.outer;
    mesh_.tetrahedron[tetrahedron_of(facet.outer)].mate[index_of(facet.outer)] =
        make_side(facet.slot, 0);
  }

  /// Passes over the facets twice: the first pass writes the edges of each into a table, the second
  /// finds its neighbours' edges there, in the opposite direction.
  void fill_small(std::uint32_t vertex) {
    constexpr std::uint32_t kStride = Cavity::kStride;
    Side* const by_edge = cavity_.by_edge.data();
    auto* const vertices = mesh_.vertex.data();
    std::uint32_t numbered = 1;
    std::int64_t ghosts = 0;
    for (std::size_t i = 0; i < facet_count_; ++i) {
      Cavity::Facet& facet = cavity_.facets[i];
      write(vertex, facet);
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = facet.corner[k];
        if (v == kGhost) [[unlikely]] {
          facet.local[k] = 0;
          ++ghosts;
          continue;
        }
        std::uint32_t& incident = vertices[v].incident;
        if ((incident & kLocalBit) == 0) incident = kLocalBit | numbered++;
        facet.local[k] = incident & ~kLocalBit;
      }
      const auto& [a, b, c] = facet.local;
      by_edge[b * kStride + c] = make_side(facet.slot, 1);
      by_edge[c * kStride + a] = make_side(facet.slot, 2);
      by_edge[a * kStride + b] = make_side(facet.slot, 3);
    }
    for (std::size_t i = 0; i < facet_count_; ++i) {
      const Cavity::Facet& facet = cavity_.facets[i];
      auto& mate = mesh_.tetrahedron[facet.slot].mate;
      const auto& [a, b, c] = facet.local;
      mate[1] = by_edge[c * kStride + b];
      mate[2] = by_edge[a * kStride + c];
      mate[3] = by_edge[b * kStride + a];
      for (const std::uint32_t v : facet.corner)
        if (v != kGhost) vertices[v].incident = facet.slot;
    }
    finish(vertex, ghosts);
  }

  /// The same for any number of facets, by sorting the edges.
  void fill_large(std::uint32_t vertex) {
    auto& edges = cavity_.edges;
    edges.clear();
    std::int64_t ghosts = 0;
    for (std::size_t i = 0; i < facet_count_; ++i) {
      Cavity::Facet& facet = cavity_.facets[i];
      write(vertex, facet);
      for (std::uint32_t k = 0; k < 3; ++k) {
        if (facet.corner[k] == kGhost) {
          ++ghosts;
        } else {
          mesh_.vertex[facet.corner[k]].incident = facet.slot;
        }
        const auto [low, high] = std::minmax(facet.corner[(k + 1) % 3], facet.corner[(k + 2) % 3]);
        edges.push_back({std::uint64_t{low} << 32 | high, make_side(facet.slot, k + 1)});
      }
    }
    std::sort(edges.begin(), edges.end(),
              [](const auto& a, const auto& b) { return a.vertices < b.vertices; });
    for (std::size_t i = 0; i < edges.size(); i += 2) {
      assert(edges[i].vertices == edges[i + 1].vertices);
      mesh_.link(edges[i].side, edges[i + 1].side);
    }
    finish(vertex, ghosts);
  }

  void finish(std::uint32_t vertex, std::int64_t ghosts) {
    mesh_.vertex[vertex].incident = cavity_.facets[0].slot;
    part_.count(mesh_, -ghosts, static_cast<std::int64_t>(facet_count_));
  }

  Mesh<Kernel>& mesh_;
  Cavity& cavity_;
  Part& part_;
  std::size_t inside_count_ = 0;
  std::size_t facet_count_ = 0;
  bool out_of_room_ = false;
};

/// The whole mesh as a single part.
struct WholeMesh : Everywhere {
  template <class Mesh>
  static std::uint32_t new_tetrahedron(Mesh& mesh) {
    return mesh.new_tetrahedron();
  }
  template <class Mesh>
  static void free_tetrahedron(Mesh& mesh, std::uint32_t t) {
    mesh.free_tetrahedron_slot(t);
  }
  /// Counts finite tetrahedra: `all` includes ghosts.
  template <class Mesh>
  static void count(Mesh& mesh, std::int64_t not_ghosts, std::int64_t all) {
    mesh.finite_count = static_cast<std::uint32_t>(mesh.finite_count + not_ghosts + all);
  }
};

}  // namespace terrace::tri::spatial
