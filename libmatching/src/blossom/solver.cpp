// SPDX-License-Identifier: Apache-2.0
// The main loop of the blossom solver: the graph, the initial duals, and the searches from exposed
// vertices.
#include "blossom/solver.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include <terrace/base/stop_check.hpp>

namespace terrace::matching::blossom {

Solver::Solver(std::uint32_t n, std::vector<Edge> edges, std::uint32_t last_vertex,
               base::StopTicks ticks)
    : n_(n),
      last_vertex_(last_vertex),
      ticks_(ticks),
      edges_(std::move(edges)),
      vertices_(n),
      sets_(n),
      nodes_(n) {
  for (std::uint32_t v = 0; v < n; ++v) {
    vertices_[v].set = v;
    vertices_[v].key = std::numeric_limits<std::int64_t>::max();
    sets_[v] = v;
    nodes_[v].first = nodes_[v].last = nodes_[v].set = nodes_[v].base = v;
  }
  index_arcs();
}

void Solver::index_arcs() {
  arc_begin_.assign(static_cast<std::size_t>(n_) + 1, 0);
  for (const Edge& e : edges_) {
    ++arc_begin_[e.i + std::size_t{1}];
    ++arc_begin_[e.j + std::size_t{1}];
  }
  for (std::uint32_t v = 0; v < n_; ++v) arc_begin_[v + std::size_t{1}] += arc_begin_[v];
  arcs_.resize(2 * edges_.size());
  std::vector<std::size_t> next_arc(arc_begin_.begin(), arc_begin_.end() - 1);
  for (const Edge& e : edges_) {
    arcs_[next_arc[e.i]++] = {e.cost, e.j};
    arcs_[next_arc[e.j]++] = {e.cost, e.i};
  }
}

// Half the least weight at each vertex is feasible. Then the potential of each exposed vertex is
// raised as far as possible, and the vertex takes an exposed neighbour if their edge is tight.
void Solver::start_duals() {
  const auto arcs_of = [&](std::uint32_t v) {
    return std::span<const Arc>(arcs_).subspan(arc_begin_[v],
                                               arc_begin_[v + std::size_t{1}] - arc_begin_[v]);
  };
  for (std::uint32_t v = 0; v < n_; ++v) {
    std::int64_t least = std::numeric_limits<std::int64_t>::max();
    for (const Arc& arc : arcs_of(v)) {
      if (arc.to != last_vertex_) least = std::min(least, arc.cost);
    }
    // Costs are even. The last vertex starts so low that no search reaches it.
    if (least != std::numeric_limits<std::int64_t>::max()) vertices_[v].potential = least / 2;
    if (v == last_vertex_) vertices_[v].potential = -kLimit / 4;
  }
  for (std::uint32_t v = 0; v < n_; ++v) {
    if (v == last_vertex_ || nodes_[v].mate != kNone || arcs_of(v).empty()) continue;
    std::int64_t slack = std::numeric_limits<std::int64_t>::max();
    std::uint32_t partner = kNone;
    for (const Arc& arc : arcs_of(v)) {
      const std::int64_t s = arc.cost - vertices_[v].potential - vertices_[arc.to].potential;
      if (s < slack || (s == slack && partner == kNone && nodes_[arc.to].mate == kNone)) {
        slack = s;
        partner = nodes_[arc.to].mate == kNone ? arc.to : kNone;
      }
    }
    vertices_[v].potential += slack;
    if (partner != kNone) {
      nodes_[v].mate = partner;
      nodes_[partner].mate = v;
    }
  }
}

std::uint32_t Solver::solve() {
  if (!std::exchange(has_duals_, true)) start_duals();
  std::uint32_t exposed_count = 0;
  for (std::uint32_t x = 0; x < node_count(); ++x) {
    if (in_use(x) && nodes_[x].parent == kNone && nodes_[x].mate == kNone) ++exposed_count;
  }
  const auto is_exposed = [&](std::uint32_t v) { return nodes_[top(v)].mate == kNone; };
  // Trees stop at a limit that grows from pass to pass. The exposed vertices thus rise about
  // evenly, their trees meet half way and stay small, and few are left for the searches without a
  // limit.
  std::int64_t limit = first_limit();
  while (true) {
    const bool unlimited = exposed_count <= 2 || limit > kLimit / 16;
    const std::uint32_t previous_count = exposed_count;
    for (std::uint32_t v = 0; v < n_; ++v) {
      ticks_();
      // Only the base of an exposed blossom is its root, so each pass searches from the blossom
      // once.
      if (!is_exposed(v) || nodes_[top(v)].base != v) continue;
      const bool only_last =
          exposed_count == 2 && last_vertex_ != kNone && is_exposed(last_vertex_);
      if (v == last_vertex_ && !only_last) continue;
      // When only two are exposed, the search starts at the last vertex, whose tree is one edge.
      const std::uint32_t root = top(only_last ? last_vertex_ : v);
      const Outcome outcome =
          search(root, unlimited || only_last ? std::numeric_limits<std::int64_t>::max() : limit);
      if (outcome == Outcome::impossible) return nodes_[root].base;
      if (outcome == Outcome::augmented) exposed_count -= 2;
    }
    if (exposed_count == 0) return kNone;
    limit += exposed_count < previous_count ? limit / 8 + 1 : limit;
  }
}

// Returns a sixteenth of the mean, over all vertices, of the least cost at each vertex.
std::int64_t Solver::first_limit() const {
  double sum = 0.0;
  for (std::uint32_t v = 0; v < n_; ++v) {
    std::int64_t least = kLimit;
    for (std::size_t k = arc_begin_[v]; k < arc_begin_[v + std::size_t{1}]; ++k) {
      if (arcs_[k].to != last_vertex_) least = std::min(least, arcs_[k].cost);
    }
    sum += least == kLimit ? 0.0 : static_cast<double>(least);
  }
  return n_ == 0 ? 1 : static_cast<std::int64_t>(std::max(1.0, sum / 16.0 / n_));
}

std::vector<std::uint32_t> Solver::mates() {
  std::vector<std::uint32_t> mate(n_, kNone), open;
  // Each part of a blossom is a range of the blossom's list of vertices.
  std::vector<std::uint32_t> position(n_, 0);
  const auto contains = [&](std::uint32_t node, std::uint32_t vertex) {
    const Node& x = nodes_[node];
    return position[x.first] <= position[vertex] && position[vertex] <= position[x.last];
  };
  for (std::uint32_t node = 0; node < node_count(); ++node) {
    if (!in_use(node) || nodes_[node].parent != kNone) continue;
    std::uint32_t place = 0;
    for (std::uint32_t v = nodes_[node].first;; v = vertices_[v].next) {
      position[v] = place++;
      if (v == nodes_[node].last) break;
    }
    open.push_back(node);
    while (!open.empty()) {
      const std::uint32_t x = open.back();
      open.pop_back();
      if (x < n_) {
        mate[x] = nodes_[x].mate;
        continue;
      }
      const std::vector<Part>& cycle = parts(x);
      std::uint32_t exit = 0;
      while (!contains(cycle[exit].node, nodes_[x].base)) ++exit;
      match_parts(x, exit);
      for (const Part& part : parts(x)) open.push_back(part.node);
    }
  }
  return mate;
}

Matching proof_of(Solver& solver) {
  const std::uint32_t n = solver.vertex_count();
  Matching result;
  result.mate = solver.mates();
  std::vector<std::uint32_t> number(solver.node_count(), kNone);
  std::uint32_t used = 0;
  for (std::uint32_t b = n; b < solver.node_count(); ++b) {
    if (solver.in_use(b)) number[b] = used++;
  }
  const auto numbered = [&](std::uint32_t node) { return node == kNone ? kNone : number[node]; };
  result.blossom_dual.resize(used);
  result.blossom_parent.resize(used);
  for (std::uint32_t b = n; b < solver.node_count(); ++b) {
    if (!solver.in_use(b)) continue;
    result.blossom_dual[number[b]] = solver.blossom_dual(b);
    result.blossom_parent[number[b]] = numbered(solver.parent(b));
  }
  result.vertex_dual.resize(n);
  result.vertex_blossom.resize(n);
  // A potential is the sum of the vertex's own dual and the duals of the blossoms around it. The
  // sums are computed once per blossom, because nests may be deep.
  std::vector<std::int64_t> enclosing_duals(solver.node_count(), -1);
  std::vector<std::uint32_t> chain;
  for (std::uint32_t v = 0; v < n; ++v) {
    chain.clear();
    std::uint32_t b = solver.parent(v);
    while (b != kNone && enclosing_duals[b] < 0) {
      chain.push_back(b);
      b = solver.parent(b);
    }
    std::int64_t sum = b == kNone ? 0 : enclosing_duals[b];
    for (; !chain.empty(); chain.pop_back()) {
      sum += solver.blossom_dual(chain.back());
      enclosing_duals[chain.back()] = sum;
    }
    result.vertex_dual[v] = solver.potential(v) - sum;
    result.vertex_blossom[v] = numbered(solver.parent(v));
  }
  return result;
}

std::string unmatchable_message(const Solver& solver, std::uint32_t vertex) {
  const std::vector<std::uint32_t>& witness = solver.witness();
  std::string text = "the graph has no perfect matching: vertex " + std::to_string(vertex) +
                     " cannot be matched; removing the " + std::to_string(witness.size()) +
                     " vertices {";
  const std::size_t listed = std::min<std::size_t>(witness.size(), 8);
  for (std::size_t k = 0; k < listed; ++k) {
    text += (k == 0 ? "" : ", ") + std::to_string(witness[k]);
  }
  if (listed < witness.size()) text += ", ...";
  return text + "} leaves " + std::to_string(witness.size() + 1) +
         " components of odd size; add edges between these";
}

}  // namespace terrace::matching::blossom
