// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/matching.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include <terrace/base/stop_check.hpp>

#include "blossom/solver.hpp"

namespace terrace::matching {
namespace {

using blossom::Edge;
using blossom::Solver;

[[noreturn]] void refuse_edges(const std::string& what) {
  throw std::invalid_argument("min_weight_perfect_matching: " + what);
}

template <class EdgeType>
void check_ends(std::size_t vertex_count, std::span<const EdgeType> edges) {
  if (vertex_count % 2 != 0) {
    refuse_edges(
        std::to_string(vertex_count) +
        " vertices, an odd number, have no perfect matching; add one with edges of weight 0");
  }
  if (vertex_count >= std::size_t{1} << 30) {
    refuse_edges(std::to_string(vertex_count) + " vertices would need " +
                 std::to_string(vertex_count / 10000000) + " GB; at most 2^30 - 1 are possible");
  }
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const EdgeType& e = edges[k];
    if (e.i >= vertex_count || e.j >= vertex_count || e.i == e.j) {
      refuse_edges("edge " + std::to_string(k) + " joins " + std::to_string(e.i) + " and " +
                   std::to_string(e.j) + "; ends must differ and be below " +
                   std::to_string(vertex_count));
    }
  }
}

template <class EdgeType>
Matching solve(std::size_t vertex_count, std::span<const EdgeType> edges, int exponent,
               const std::vector<Edge>& doubled_edges, const base::StopCheck& check_stop) {
  Solver solver(static_cast<std::uint32_t>(vertex_count), doubled_edges, kNone,
                base::StopTicks(check_stop));
  const std::uint32_t exposed = solver.solve();
  if (exposed != kNone) refuse_edges(blossom::unmatchable_message(solver, exposed));
  Matching result = blossom::proof_of(solver);
  result.exponent = exponent;
  // The cheapest of several edges between the same vertices is the matched one.
  std::vector<std::size_t> matched(vertex_count, edges.size());
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const EdgeType& e = edges[k];
    if (result.mate[e.i] != e.j) continue;
    std::size_t& best = matched[std::min(e.i, e.j)];
    if (best == edges.size() || e.weight < edges[best].weight) best = k;
  }
  for (const std::size_t k : matched) {
    if (k != edges.size()) result.cost += static_cast<double>(edges[k].weight);
  }
  return result;
}

std::int64_t integer_weight(const WeightedEdge& e, int exponent) {
  return std::llround(std::ldexp(e.weight, exponent));
}
std::int64_t integer_weight(const IntegerEdge& e, int) { return e.weight; }

/// Returns the chain of blossoms around a vertex, from the innermost outward.
std::vector<std::uint32_t> chain_of(const Matching& m, std::uint32_t vertex) {
  std::vector<std::uint32_t> chain;
  for (std::uint32_t b = m.vertex_blossom[vertex]; b != kNone; b = m.blossom_parent[b]) {
    if (chain.size() > m.blossom_parent.size()) break;
    chain.push_back(b);
  }
  std::reverse(chain.begin(), chain.end());
  return chain;
}

/// Returns the sum of the duals of the blossoms that contain exactly one of two vertices.
std::int64_t separating_duals(const Matching& m, std::uint32_t i, std::uint32_t j) {
  const std::vector<std::uint32_t> a = chain_of(m, i), b = chain_of(m, j);
  std::size_t shared = 0;
  while (shared < a.size() && shared < b.size() && a[shared] == b[shared]) ++shared;
  std::int64_t sum = 0;
  for (std::size_t k = shared; k < a.size(); ++k) sum += m.blossom_dual[a[k]];
  for (std::size_t k = shared; k < b.size(); ++k) sum += m.blossom_dual[b[k]];
  return sum;
}

/// Describes the first fault of the arrays themselves: sizes, indices and signs. Empty if there is
/// none.
std::string shape_error(const Matching& m) {
  const std::size_t n = m.mate.size(), blossoms = m.blossom_dual.size();
  if (m.vertex_dual.size() != n || m.vertex_blossom.size() != n ||
      m.blossom_parent.size() != blossoms) {
    return "the arrays differ in size";
  }
  for (std::size_t v = 0; v < n; ++v) {
    if (m.mate[v] >= n || m.mate[v] == v || m.mate[m.mate[v]] != v) {
      return "vertex " + std::to_string(v) + " is not the partner of its partner";
    }
    if (m.vertex_blossom[v] != kNone && m.vertex_blossom[v] >= blossoms) {
      return "vertex " + std::to_string(v) + " names a blossom that does not exist";
    }
  }
  for (std::size_t b = 0; b < blossoms; ++b) {
    if (m.blossom_parent[b] != kNone && m.blossom_parent[b] >= blossoms) {
      return "blossom " + std::to_string(b) + " names a parent that does not exist";
    }
    if (m.blossom_dual[b] < 0) return "blossom " + std::to_string(b) + " has a negative dual";
  }
  return {};
}

/// Checks that blossoms have odd sizes and that one matched edge crosses the border of each blossom
/// with a nonzero dual. Describes the first fault. Empty if there is none.
std::string blossom_error(const Matching& m) {
  std::vector<std::size_t> size(m.blossom_dual.size(), 0), crossing(m.blossom_dual.size(), 0);
  for (std::uint32_t v = 0; v < m.mate.size(); ++v) {
    const std::vector<std::uint32_t> chain = chain_of(m, v), mate_chain = chain_of(m, m.mate[v]);
    for (std::size_t k = 0; k < chain.size(); ++k) {
      ++size[chain[k]];
      if (k >= mate_chain.size() || mate_chain[k] != chain[k]) ++crossing[chain[k]];
    }
  }
  for (std::size_t b = 0; b < size.size(); ++b) {
    if (size[b] % 2 == 0) return "blossom " + std::to_string(b) + " has an even size";
    if (m.blossom_dual[b] != 0 && crossing[b] != 1) {
      return "blossom " + std::to_string(b) + " has " + std::to_string(crossing[b]) +
             " matched edges over its border";
    }
  }
  return {};
}

template <class EdgeType>
std::string error_of(const Matching& m, std::span<const EdgeType> edges) {
  if (std::string error = shape_error(m); !error.empty()) return error;
  if (std::string error = blossom_error(m); !error.empty()) return error;
  std::vector<bool> tight(m.mate.size(), false);
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const EdgeType& e = edges[k];
    if (e.i >= m.mate.size() || e.j >= m.mate.size() || e.i == e.j) {
      return "edge " + std::to_string(k) + " is not in the graph";
    }
    const std::int64_t slack = 2 * integer_weight(e, m.exponent) - m.vertex_dual[e.i] -
                               m.vertex_dual[e.j] - separating_duals(m, e.i, e.j);
    if (slack < 0) {
      return "edge " + std::to_string(k) + " violates the duals by " + std::to_string(-slack);
    }
    if (slack == 0 && m.mate[e.i] == e.j) tight[e.i] = tight[e.j] = true;
  }
  for (std::size_t v = 0; v < tight.size(); ++v) {
    if (!tight[v]) return "the matched edge of vertex " + std::to_string(v) + " is not tight";
  }
  return {};
}

}  // namespace

double Matching::dual_bound() const {
  // Adds integers in two parts, so that the sum is exact and does not overflow.
  double high = 0.0;
  std::int64_t low = 0;
  const auto add = [&](std::int64_t dual) {
    constexpr std::int64_t kPart = std::int64_t{1} << 32;
    high += static_cast<double>(dual / kPart);
    low += dual % kPart;
  };
  for (const std::int64_t dual : vertex_dual) add(dual);
  for (const std::int64_t dual : blossom_dual) add(dual);
  return std::ldexp(high * 0x1p32 + static_cast<double>(low), -1 - exponent);
}

Matching min_weight_perfect_matching(std::size_t vertex_count, std::span<const WeightedEdge> edges,
                                     const base::StopCheck& check_stop) {
  check_ends(vertex_count, edges);
  double largest = 0.0;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    if (!std::isfinite(edges[k].weight))
      refuse_edges("the weight of edge " + std::to_string(k) + " is not finite");
    largest = std::max(largest, std::abs(edges[k].weight));
  }
  int top = 0;
  std::frexp(largest, &top);
  for (int bits = 52;; bits -= 9) {
    const int exponent = bits - top;
    std::vector<Edge> doubled_edges;
    doubled_edges.reserve(edges.size());
    for (const WeightedEdge& e : edges)
      doubled_edges.push_back({e.i, e.j, 2 * integer_weight(e, exponent)});
    try {
      return solve(vertex_count, edges, exponent, doubled_edges, check_stop);
    } catch (const std::overflow_error&) {
      if (bits <= 34) throw;
    }
  }
}

Matching min_weight_perfect_matching(std::size_t vertex_count, std::span<const IntegerEdge> edges,
                                     const base::StopCheck& check_stop) {
  check_ends(vertex_count, edges);
  std::vector<Edge> doubled_edges;
  doubled_edges.reserve(edges.size());
  constexpr std::int64_t kLargest = blossom::kLimit / 8;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const IntegerEdge& e = edges[k];
    if (e.weight > kLargest || e.weight < -kLargest) {
      refuse_edges("edge " + std::to_string(k) + " weighs " + std::to_string(e.weight) +
                   "; weights up to 2^57 fit; divide them");
    }
    doubled_edges.push_back({e.i, e.j, 2 * e.weight});
  }
  return solve(vertex_count, edges, 0, doubled_edges, check_stop);
}

std::string matching_error(const Matching& matching, std::span<const WeightedEdge> edges) {
  return error_of(matching, edges);
}

std::string matching_error(const Matching& matching, std::span<const IntegerEdge> edges) {
  return error_of(matching, edges);
}

}  // namespace terrace::matching
