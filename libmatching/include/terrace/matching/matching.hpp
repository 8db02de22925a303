// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <terrace/base/stop_check.hpp>

namespace terrace::matching {

/// Stands for "no vertex" and "no blossom".
inline constexpr std::uint32_t kNobody = 0xFFFFFFFFu;

/// An edge of a graph: two different vertices and the cost of matching them.
struct WeightedEdge {
  std::uint32_t i, j;
  double weight;
};

struct IntegerEdge {
  std::uint32_t i, j;
  std::int64_t weight;
};

/// A perfect matching of least weight with the dual solution that proves it.
///
/// The weight w of an edge counts as the integer W = round(w * 2^exponent). In these units the
/// proof is exact: vertex_dual[i] + vertex_dual[j] + (duals of the blossoms with exactly one end
/// inside) is at most 2 W for every edge, with equality for matched edges; blossom duals are not
/// negative; a blossom with a nonzero dual has an odd number of vertices and one matched edge
/// across its border.
struct Matching {
  std::vector<std::uint32_t> mate;  ///< partner of each vertex
  double cost = 0.0;                ///< sum of the weights of the matched edges
  int exponent = 0;                 ///< weights are counted in units of 2^-exponent
  std::vector<std::int64_t> vertex_dual;
  std::vector<std::int64_t> blossom_dual;
  /// Blossoms nest: the innermost blossom around each vertex and the next one around each blossom,
  /// or kNobody. A blossom contains the vertices from which it is reached.
  std::vector<std::uint32_t> vertex_blossom, blossom_parent;

  /// Half the sum of all duals, times 2^-exponent: a lower bound for every perfect matching of the
  /// rounded weights.
  double dual_bound() const;
};

/// Minimum-weight perfect matching of a graph on vertices 0 .. vertex_count - 1.
///
/// edges: any number, parallel edges allowed, weights finite and of any sign.
/// Returns: a matching that is optimal for the rounded weights. For integer weights the exponent is
/// 0 and nothing is rounded. For double weights it is chosen so that the largest takes 52 bits (43
/// or 34 where the duals would otherwise not fit into 64 bits), so each weight is off by at most
/// 2^-52 of the largest, and the cost exceeds the optimum by at most vertex_count * 2^-52 times it
/// (2^-34 with 34 bits).
///
/// Throws: std::invalid_argument for an end that is not a vertex, a loop, a weight that is not
/// finite or too large (the edge is named), an odd vertex_count, and a graph without a perfect
/// matching (names a vertex that no matching covers and the set whose removal proves it);
/// std::overflow_error if the duals still do not fit into 64 bits.
///
/// Deterministic: the result depends on the input alone.
///
/// Cost: O(vertices * edges * log) in the worst case; on sparse geometric graphs most trees are
/// small. About 100 bytes per vertex and 48 per edge.
///
/// Source: J. Edmonds, "Paths, trees, and flowers", 1965; the initial duals and the order of dual
/// changes follow V. Kolmogorov, "Blossom V: a new implementation of a minimum cost perfect
/// matching algorithm", 2009, but one tree at a time, each stopped at a limit that grows from pass
/// to pass.
Matching min_weight_perfect_matching(std::size_t vertex_count, std::span<const WeightedEdge> edges,
                                     const base::StopCheck& check_stop = {});
Matching min_weight_perfect_matching(std::size_t vertex_count, std::span<const IntegerEdge> edges,
                                     const base::StopCheck& check_stop = {});

/// Checks the proof that comes with a matching. Returns an empty string, or a description of the
/// fault.
/// Cost: O(vertices + edges) times the depth of nesting.
std::string matching_error(const Matching& matching, std::span<const WeightedEdge> edges);
std::string matching_error(const Matching& matching, std::span<const IntegerEdge> edges);

}  // namespace terrace::matching
