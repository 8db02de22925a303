// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <terrace/base/stop_check.hpp>

#include "terrace/matching/assignment.hpp"

namespace terrace::matching {

/// The pairs that may be chosen, with their costs, in compressed rows: row i has the entries
/// [begin[i], begin[i + 1]) of `column` and `cost`. If a pair occurs more than once, the cheapest
/// entry counts.
struct SparseCosts {
  std::size_t columns = 0;
  std::span<const std::size_t> begin;  ///< rows + 1 offsets, the first 0, not decreasing
  std::span<const std::uint32_t> column;
  std::span<const double> cost;
};

/// One pair that may be chosen, for lists in any order.
struct CostEdge {
  std::uint32_t row, column;
  double cost;
};

/// Minimum-cost assignment where only the given pairs may be chosen.
///
/// Returns: the assignment of min(rows, columns) rows of least cost, with labels that prove it
/// optimal on the given pairs (row_dual[i] + column_dual[j] <= cost for each of them).
/// Throws: std::invalid_argument if an offset, row or column is out of range, if a cost is not
/// finite or exceeds kLargestCost (the message names the entry), or if there is no such assignment.
/// In that case the message names a row from a set of rows that reach fewer columns than it has
/// rows (Hall's theorem), or, with rows > columns, a column from such a set of columns.
/// Cost: O(n m log m) time at worst for n on the shorter side and m pairs, O(m) memory. Pairs of
/// near neighbours take far less, as the trees stay small.
/// Source: J. Skála, 4.3.1, with Dijkstra's algorithm and a heap on the pairs. Optimality is proven
/// by complementary slackness.
Assignment assign_sparse(const SparseCosts& costs, const base::StopCheck& check_stop = {});
Assignment assign_sparse(std::span<const CostEdge> edges, std::size_t rows, std::size_t columns,
                         const base::StopCheck& check_stop = {});

/// As check() in assignment.hpp, on the given pairs.
///
/// Throws: also if the column of a row is not among the row's pairs.
double check(const Assignment& assignment, const SparseCosts& costs);
double check(const Assignment& assignment, std::span<const CostEdge> edges, std::size_t rows,
             std::size_t columns);

}  // namespace terrace::matching
