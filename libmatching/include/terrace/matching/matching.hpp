// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <terrace/base/stop_check.hpp>

namespace terrace::matching {

/// Means "no vertex" or "no blossom".
inline constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// An edge of a graph: two different vertices and the cost of matching them.
struct WeightedEdge {
  std::uint32_t i, j;
  double weight;
};

struct IntegerEdge {
  std::uint32_t i, j;
  std::int64_t weight;
};

/// A perfect matching of least weight with the dual solution that proves it optimal.
///
/// The weight w of an edge counts as the integer W = round(w * 2^exponent). In these units the
/// proof is exact. For every edge, vertex_dual[i] + vertex_dual[j] + (duals of the blossoms with
/// exactly one end inside) is at most 2 W, with equality for matched edges. Blossom duals are at
/// least 0. A blossom with a nonzero dual has an odd number of vertices and one matched edge across
/// its border.
struct Matching {
  std::vector<std::uint32_t> mate;  ///< partner of each vertex
  double cost = 0.0;                ///< sum of the weights of the matched edges
  int exponent = 0;                 ///< weights are counted in units of 2^-exponent
  std::vector<std::int64_t> vertex_dual;
  std::vector<std::int64_t> blossom_dual;
  /// Nesting of the blossoms: the innermost blossom around each vertex and the next one around each
  /// blossom, or kNone. A blossom contains the vertices whose chains of parents include it.
  std::vector<std::uint32_t> vertex_blossom, blossom_parent;

  /// Half the sum of all duals, times 2^-exponent. It is a lower bound for every perfect matching
  /// of the rounded weights.
  double dual_bound() const;
};

/// Minimum-weight perfect matching of a graph on vertices 0 .. vertex_count - 1.
///
/// edges: any number, parallel edges allowed, weights finite and of any sign.
/// Returns: a matching that is optimal for the rounded weights. For integer weights the exponent is
/// 0 and nothing is rounded. For double weights the exponent is chosen so that the largest weight
/// takes 52 bits (43 or 34 where the duals would otherwise not fit into 64 bits). Each weight is
/// then off by at most 2^-52 of the largest weight, and the cost exceeds the optimum by at most
/// vertex_count * 2^-52 times the largest weight (2^-34 with 34 bits).
///
/// Throws: std::invalid_argument for an end that is not a vertex, a loop, a weight that is not
/// finite or too large (the message names the edge), an odd vertex_count, and a graph without a
/// perfect matching (the message names a vertex that cannot be matched and the set whose removal
/// proves it);
/// std::overflow_error if the duals still do not fit into 64 bits.
///
/// Deterministic: the result depends on the input alone.
///
/// Cost: O(vertices * edges * log) in the worst case. On sparse geometric graphs most trees are
/// small. About 100 bytes per vertex and 48 per edge.
///
/// Source: J. Edmonds, "Paths, trees, and flowers", 1965. The initial duals and the order of dual
/// changes follow V. Kolmogorov, "Blossom V: a new implementation of a minimum cost perfect
/// matching algorithm", 2009, except that one tree grows at a time, up to a limit that rises from
/// pass to pass.
Matching min_weight_perfect_matching(std::size_t vertex_count, std::span<const WeightedEdge> edges,
                                     const base::StopCheck& check_stop = {});
Matching min_weight_perfect_matching(std::size_t vertex_count, std::span<const IntegerEdge> edges,
                                     const base::StopCheck& check_stop = {});

/// Checks the proof that comes with a matching. Returns an empty string if it holds, otherwise a
/// description of the first fault.
/// Cost: O(vertices + edges) times the depth of nesting.
std::string matching_error(const Matching& matching, std::span<const WeightedEdge> edges);
std::string matching_error(const Matching& matching, std::span<const IntegerEdge> edges);

}  // namespace terrace::matching
