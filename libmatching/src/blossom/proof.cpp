// SPDX-License-Identifier: Apache-2.0
#include "blossom/proof.hpp"

#include <algorithm>
#include <string>

namespace terrace::matching::blossom {

Matching proof_of(Solver& solver) {
  const std::uint32_t n = solver.vertex_count();
  Matching result;
  result.mate = solver.mates();
  std::vector<std::uint32_t> number(solver.node_count(), kNobody);
  std::uint32_t used = 0;
  for (std::uint32_t b = n; b < solver.node_count(); ++b) {
    if (solver.in_use(b)) number[b] = used++;
  }
  const auto numbered = [&](std::uint32_t node) { return node == kNone ? kNobody : number[node]; };
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
  std::vector<std::int64_t> around(solver.node_count(), -1);
  std::vector<std::uint32_t> chain;
  for (std::uint32_t v = 0; v < n; ++v) {
    chain.clear();
    std::uint32_t b = solver.parent(v);
    while (b != kNone && around[b] < 0) {
      chain.push_back(b);
      b = solver.parent(b);
    }
    std::int64_t sum = b == kNone ? 0 : around[b];
    for (; !chain.empty(); chain.pop_back()) {
      sum += solver.blossom_dual(chain.back());
      around[chain.back()] = sum;
    }
    result.vertex_dual[v] = solver.potential(v) - sum;
    result.vertex_blossom[v] = numbered(solver.parent(v));
  }
  return result;
}

std::string unmatchable(const Solver& solver, std::uint32_t vertex) {
  const std::vector<std::uint32_t>& witness = solver.witness();
  std::string text = "the graph has no perfect matching: vertex " + std::to_string(vertex) +
                     " cannot be matched; removing the " + std::to_string(witness.size()) +
                     " vertices {";
  const std::size_t shown = std::min<std::size_t>(witness.size(), 8);
  for (std::size_t k = 0; k < shown; ++k) {
    text += (k == 0 ? "" : ", ") + std::to_string(witness[k]);
  }
  if (shown < witness.size()) text += ", ...";
  return text + "} leaves " + std::to_string(witness.size() + 1) +
         " components of odd size; add edges between these";
}

}  // namespace terrace::matching::blossom
