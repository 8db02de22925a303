// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace terrace::matching {

/// Stands for the column of a row that got none.
inline constexpr std::uint32_t kUnassigned = 0xFFFFFFFFu;

/// Which column each row got, what that costs, and the proof that nothing is cheaper.
template <class Number>
struct BasicAssignment {
  /// Each row's column, or kUnassigned. As many rows have one as rows and columns allow;
  /// all columns are different.
  std::vector<std::uint32_t> column;
  Number cost = 0;  ///< sum of the chosen entries, added in row order
  /// Feasible labels: row_dual[i] + column_dual[j] <= cost(i, j), with equality where j is the
  /// column of i. With rows <= columns, column_dual[j] <= 0, and 0 for columns that no row got;
  /// with rows > columns, row_dual[i] <= 0, and 0 for rows that stay without a column.
  std::vector<Number> row_dual, column_dual;
};

/// For costs of type double and float: equality and order hold up to rounding.
using Assignment = BasicAssignment<double>;
/// For integer costs: exact.
using IntegerAssignment = BasicAssignment<std::int64_t>;

/// The largest magnitude of a cost that is accepted: sums of many such must stay finite.
inline constexpr double kLargestCost = 1e300;

/// Minimum-cost assignment of rows to columns (Kuhn-Munkres by shortest augmenting paths).
///
/// costs: rows x columns, row-major; any unit, the result has the same.
/// Requires: costs.size() == rows * columns, rows and columns below 2^32 - 1, every entry finite
/// and at most kLargestCost in magnitude.
/// Returns: an assignment of min(rows, columns) rows of least cost; among equal ones the choice is
/// fixed by the input alone, the same on every machine.
/// Throws: std::invalid_argument if a requirement is broken (a bad entry's row and column are
/// named).
/// Cost: O(rows * columns * min(rows, columns)) time, O(rows + columns) memory.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 4.3.1 (feasible labels,
/// equality subgraph, alternating trees). Equations 4.27 to 4.29 are printed for the largest sum;
/// here the labels are kept below the costs, for the least. A tree grows as by Dijkstra's
/// algorithm, so that its n label changes cost O(n^2) together, after rows were given their
/// columns by augmenting row reduction: R. Jonker and A. Volgenant, "A shortest augmenting path
/// algorithm for dense and sparse linear assignment problems", 1987.
Assignment assign(std::span<const double> costs, std::size_t rows, std::size_t columns);
Assignment assign(std::span<const float> costs, std::size_t rows, std::size_t columns);
/// Labels and cost are exact: every sum fits in 64 bits.
IntegerAssignment assign(std::span<const std::int32_t> costs, std::size_t rows,
                         std::size_t columns);

/// Writes the costs of one row into `costs`, one for each column. Asked for the same row several
/// times, it must give the same numbers.
using CostRow = std::function<void(std::size_t row, std::span<double> costs)>;

/// The same with costs from a function: no matrix is ever stored.
///
/// Throws: std::invalid_argument as above, std::bad_function_call if fill_row is empty, and
/// whatever fill_row throws.
/// Cost: O(rows + columns) memory; fill_row is called O(rows * min(rows, columns)) times at worst.
Assignment assign_rows(std::size_t rows, std::size_t columns, const CostRow& fill_row);

/// The same with costs from a function of row and column.
template <std::invocable<std::size_t, std::size_t> Cost>
Assignment assign_pairs(std::size_t rows, std::size_t columns, Cost&& cost) {
  return assign_rows(rows, columns, [&cost](std::size_t row, std::span<double> costs) {
    for (std::size_t j = 0; j < costs.size(); ++j) costs[j] = cost(row, j);
  });
}

/// By how much an assignment fails to be proven optimal: 0, or rounding, for a right one.
///
/// Looks at every entry: that the labels are feasible, that chosen entries are tight, that the
/// labels of the longer side are not above 0, and 0 for what stayed over, and that the cost is the
/// sum of the chosen entries.
/// Returns: the largest amount by which one of these is broken, in the unit of the costs.
/// Throws: std::invalid_argument if `assignment` is not valid: sizes that do not match, a column
/// twice or out of range, a row left without a column though one is free (the row is named).
/// Cost: O(rows * columns).
double check(const Assignment& assignment, std::span<const double> costs, std::size_t rows,
             std::size_t columns);
double check(const Assignment& assignment, std::span<const float> costs, std::size_t rows,
             std::size_t columns);
std::int64_t check(const IntegerAssignment& assignment, std::span<const std::int32_t> costs,
                   std::size_t rows, std::size_t columns);
double check_rows(const Assignment& assignment, std::size_t rows, std::size_t columns,
                  const CostRow& fill_row);

}  // namespace terrace::matching
