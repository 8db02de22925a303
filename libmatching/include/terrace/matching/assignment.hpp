// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

namespace terrace::matching {

/// Column of a row that is not assigned.
inline constexpr std::uint32_t kUnassigned = 0xFFFFFFFFu;

/// The column of each row, the total cost, and dual labels that prove that no assignment is
/// cheaper.
template <class Number>
struct BasicAssignment {
  /// Each row's column, or kUnassigned. min(rows, columns) rows have one. All columns are
  /// different.
  std::vector<std::uint32_t> column;
  Number cost = 0;  ///< sum of the chosen entries, added in row order
  /// Feasible labels: row_dual[i] + column_dual[j] <= cost(i, j), with equality where j is the
  /// column of i. With rows <= columns, column_dual[j] <= 0, and 0 for unassigned columns. With
  /// rows > columns, row_dual[i] <= 0, and 0 for unassigned rows.
  std::vector<Number> row_dual, column_dual;
};

/// For costs of type double and float: equality and order hold up to rounding.
using Assignment = BasicAssignment<double>;
/// For integer costs: exact.
using IntegerAssignment = BasicAssignment<std::int64_t>;

/// Largest accepted magnitude of a cost, chosen so that sums of many costs stay finite.
inline constexpr double kLargestCost = 1e300;

/// Minimum-cost assignment of rows to columns (Kuhn-Munkres by shortest augmenting paths).
///
/// costs: rows x columns, row-major, in any unit. The result uses the same unit.
/// Requires: costs.size() == rows * columns, rows and columns below 2^32 - 1, every entry finite
/// and at most kLargestCost in magnitude.
/// Returns: an assignment of min(rows, columns) rows of least cost. Among assignments of equal cost
/// the choice depends on the input alone and is the same on every machine.
/// Throws: std::invalid_argument if a requirement is violated. The message names the row and column
/// of a bad entry.
/// Cost: O(rows * columns * min(rows, columns)) time, O(rows + columns) memory.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 4.3.1 (feasible labels,
/// equality subgraph, alternating trees). The thesis states equations 4.27 to 4.29 for the largest
/// sum. Here, for the least sum, labels stay below the costs. Trees grow as in Dijkstra's
/// algorithm, so the n label changes of a tree cost O(n^2) together. Before that, augmenting row
/// reduction assigns most rows: R. Jonker and A. Volgenant, "A shortest augmenting path algorithm
/// for dense and sparse linear assignment problems", 1987.
Assignment assign(std::span<const double> costs, std::size_t rows, std::size_t columns,
                  const base::StopCheck& check_stop = {});
Assignment assign(std::span<const float> costs, std::size_t rows, std::size_t columns,
                  const base::StopCheck& check_stop = {});
/// Minimum-cost assignment of integer costs. Labels and cost are exact: every sum fits into 64
/// bits.
IntegerAssignment assign(std::span<const std::int32_t> costs, std::size_t rows, std::size_t columns,
                         const base::StopCheck& check_stop = {});

/// Writes the costs of one row into `costs`, one per column. Must write the same numbers whenever
/// it is called for the same row.
using CostRow = std::function<void(std::size_t row, std::span<double> costs)>;

/// As assign(), with costs from a function. The matrix is never stored.
///
/// Throws: std::invalid_argument as assign() does, std::bad_function_call if fill_row is empty, and
/// whatever fill_row throws.
/// Cost: O(rows + columns) memory. fill_row is called O(rows * min(rows, columns)) times at worst.
Assignment assign_rows(std::size_t rows, std::size_t columns, const CostRow& fill_row);

/// As assign_rows(), with costs from a function of row and column.
template <std::invocable<std::size_t, std::size_t> Cost>
Assignment assign_pairs(std::size_t rows, std::size_t columns, Cost&& cost) {
  return assign_rows(rows, columns, [&cost](std::size_t row, std::span<double> costs) {
    for (std::size_t j = 0; j < costs.size(); ++j) costs[j] = cost(row, j);
  });
}

/// Measures how far an assignment is from being proven optimal. The result is 0, up to rounding,
/// for a correct assignment.
///
/// Checks at every entry that the labels are feasible and that chosen entries are tight. Also
/// checks that the labels of the longer side are at most 0, and 0 where unassigned, and that the
/// cost is the sum of the chosen entries.
/// Returns: the largest violation, in the unit of the costs.
/// Throws: std::invalid_argument if `assignment` is not valid: sizes do not match, a column is used
/// twice or out of range, or a row has no column though one is free (the message names the row).
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
