// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "spheres.hpp"
#include "state.hpp"

/// The published rule, in rounds, see ShapeRule::kPublished.

namespace terrace::tri::shape {

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
    std::uint32_t before = spatial::kNone;
    for (const Candidate& candidate : round) {
      state.ticks(128);
      const std::uint32_t t = candidate.tetrahedron;
      if (t == before || state.of[t] != kKept) continue;
      before = t;
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
