// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrace::matching {

/// Which column each row got, what that costs, and the proof that nothing is cheaper.
struct Assignment {
  std::vector<std::uint32_t> column;  ///< of each row, all different
  double cost = 0.0;                  ///< sum of the chosen entries, added in row order
  /// Feasible labels: row_dual[i] + column_dual[j] <= cost(i, j), with equality where j is the
  /// column of i, and column_dual[j] <= 0, 0 for columns that no row got.
  std::vector<double> row_dual, column_dual;
};

/// Minimum-cost assignment of rows to columns (Kuhn-Munkres by shortest augmenting paths).
///
/// costs: rows x columns, row-major, finite; any unit, the result has the same.
/// Requires: rows <= columns and costs.size() == rows * columns.
/// Returns: the assignment of least cost; among equal ones the choice is fixed by the input alone.
/// Throws: std::invalid_argument if a requirement is broken or an entry is not finite (its row and
/// column are named).
/// Cost: O(rows^2 * columns) time, O(rows + columns) memory.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 4.3.1; the labels are kept
/// below the costs (minimisation), augmenting by shortest paths as in R. Jonker and A. Volgenant,
/// "A shortest augmenting path algorithm for dense and sparse linear assignment problems", 1987.
Assignment assign(std::span<const double> costs, std::size_t rows, std::size_t columns);

}  // namespace terrace::matching
