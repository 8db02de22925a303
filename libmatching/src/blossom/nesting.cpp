// SPDX-License-Identifier: Apache-2.0
// Blossoms outside the tree: allocates and opens them, and repairs the duals after edges were
// added.
#include <algorithm>

#include "blossom/solver.hpp"

namespace terrace::matching::blossom {

std::uint32_t Solver::new_blossom() {
  if (spare_.empty()) {
    spare_.push_back(node_count());
    nodes_.emplace_back();
    parts_.emplace_back();
  }
  const std::uint32_t blossom = spare_.back();
  spare_.pop_back();
  parts(blossom).clear();
  return blossom;
}

// The part that contains the base, `exit`, gets the blossom's matched edge. The other parts are
// paired around the cycle.
void Solver::match_parts(std::uint32_t blossom, std::uint32_t exit) {
  const std::vector<Part>& cycle = parts(blossom);
  const std::uint32_t count = static_cast<std::uint32_t>(cycle.size());
  nodes_[cycle[exit].node].base = nodes_[blossom].base;
  nodes_[cycle[exit].node].mate = nodes_[blossom].mate;
  for (std::uint32_t step = 1; step < count; step += 2) {
    const Part& part = cycle[(exit + step) % count];
    Node& x = nodes_[part.node];
    Node& y = nodes_[cycle[(exit + step + 1) % count].node];
    x.base = y.mate = part.from;
    x.mate = y.base = part.to;
  }
}

// Afterwards top() returns the part that contains a vertex. (Walking up from the vertex would take
// time proportional to the nesting depth.) Base and mate of the blossom stay readable.
void Solver::release_parts(std::uint32_t blossom) {
  Node& b = nodes_[blossom];
  for (const Part& part : parts(blossom)) {
    Node& x = nodes_[part.node];
    x.parent = kNone;
    sets_[x.set] = part.node;
    if (x.set == b.set) continue;
    for (std::uint32_t v = x.first;; v = vertices_[v].next) {
      vertices_[v].set = x.set;
      if (v == x.last) break;
    }
  }
  b.label = Label::free;
  b.first = b.last = kNone;
  b.dual = 0;
  spare_.push_back(blossom);
}

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
  std::vector<std::uint32_t> around;
  for (std::uint32_t x = nodes_[i].parent; x != kNone; x = nodes_[x].parent) around.push_back(x);
  std::vector<std::uint32_t> other;
  for (std::uint32_t x = nodes_[j].parent; x != kNone; x = nodes_[x].parent) other.push_back(x);
  std::int64_t sum = 0;
  for (std::size_t k = 1; k <= std::min(around.size(), other.size()); ++k) {
    const std::uint32_t x = around[around.size() - k];
    if (x != other[other.size() - k]) break;
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
  if (!started_) return;
  for (const Edge& edge : edges) repair(edge);
}

}  // namespace terrace::matching::blossom
