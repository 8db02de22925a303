// SPDX-License-Identifier: Apache-2.0
// Adds edges between searches, when no tree exists, and repairs the duals that they violate.
#include <algorithm>

#include "blossom/solver.hpp"

namespace terrace::matching::blossom {

void Solver::unmatch(std::uint32_t node) {
  const std::uint32_t mate = nodes_[node].mate;
  if (mate == kNone) return;
  nodes_[top(mate)].mate = kNone;
  nodes_[node].mate = kNone;
}

// Dissolves the blossoms around a vertex, whatever their duals. Edges across their borders gain
// slack, so the blossoms' own matched edges must be dissolved too. In a deep nest each vertex is
// touched only once, when its part is released.
void Solver::uncover(std::uint32_t vertex) {
  std::int64_t sum = 0;
  while (top(vertex) != vertex) {
    const std::uint32_t blossom = top(vertex);
    sum += nodes_[blossom].dual;
    if (nodes_[blossom].dual != 0) unmatch(blossom);
    release_parts(blossom);
    match_parts(blossom, nodes_[top(nodes_[blossom].base)].place);
    for (const Part& part : parts(blossom)) {
      if (part.node == top(vertex)) continue;
      for (std::uint32_t v = nodes_[part.node].first;; v = vertices_[v].next) {
        vertices_[v].potential -= sum;
        if (v == nodes_[part.node].last) break;
      }
    }
  }
  vertices_[vertex].potential -= sum;
}

std::int64_t Solver::shared_duals(std::uint32_t i, std::uint32_t j) const {
  if (top(i) != top(j)) return 0;
  std::vector<std::uint32_t> outer_of_i;
  for (std::uint32_t x = nodes_[i].parent; x != kNone; x = nodes_[x].parent)
    outer_of_i.push_back(x);
  std::vector<std::uint32_t> outer_of_j;
  for (std::uint32_t x = nodes_[j].parent; x != kNone; x = nodes_[x].parent)
    outer_of_j.push_back(x);
  std::int64_t sum = 0;
  for (std::size_t k = 1; k <= std::min(outer_of_i.size(), outer_of_j.size()); ++k) {
    const std::uint32_t x = outer_of_i[outer_of_i.size() - k];
    if (x != outer_of_j[outer_of_j.size() - k]) break;
    sum += nodes_[x].dual;
  }
  return sum;
}

// Lowers the potential of one end until the edge is feasible. That end must be a top vertex.
void Solver::repair(const Edge& edge) {
  const auto slack = [&] {
    return edge.cost - vertices_[edge.i].potential - vertices_[edge.j].potential +
           2 * shared_duals(edge.i, edge.j);
  };
  if (slack() >= 0) return;
  const auto depth = [&](std::uint32_t v) {
    std::uint32_t steps = 0;
    for (std::uint32_t x = v; nodes_[x].parent != kNone; x = nodes_[x].parent) ++steps;
    return steps;
  };
  const std::uint32_t v = depth(edge.i) <= depth(edge.j) ? edge.i : edge.j;
  uncover(v);
  const std::int64_t excess = slack();
  if (excess >= 0) return;
  vertices_[v].potential += excess;
  unmatch(v);
}

void Solver::add(std::span<const Edge> edges) {
  edges_.insert(edges_.end(), edges.begin(), edges.end());
  index_arcs();
  if (!has_duals_) return;
  for (const Edge& edge : edges) repair(edge);
}

}  // namespace terrace::matching::blossom
