// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/sparse_assignment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "assignment/check_optimal.hpp"
#include "assignment/input_check.hpp"
#include "assignment/sparse_solver.hpp"

namespace terrace::matching {
namespace {

/// Compressed rows with their own storage. Absent pairs must not be chosen.
struct EdgeLists {
  // With few edges, bidding for a column that only one row can have might never end.
  static constexpr bool kComplete = false;

  std::size_t columns = 0;
  std::vector<std::size_t> begin;
  std::vector<Candidate> edges;

  std::size_t rows() const { return begin.size() - 1; }
  std::span<const Candidate> candidates(std::size_t row) const {
    return std::span(edges).subspan(begin[row], begin[row + 1] - begin[row]);
  }
  static double threshold(std::size_t) { return std::numeric_limits<double>::infinity(); }
  std::size_t extend(std::size_t row, const std::vector<double>&, double) const {
    return candidates(row).size();
  }
  static Candidate nearest_free(std::size_t) { return {kUnassigned, 0.0}; }
  static void on_label_decrease(const std::vector<double>&, std::size_t) {}
  static void on_assigned(std::size_t) {}
};

void check_edge(std::size_t k, std::uint32_t column, std::size_t columns, double cost) {
  if (column >= columns) {
    throw std::invalid_argument("assign_sparse: entry " + std::to_string(k) + " has column " +
                                std::to_string(column) + ", but there are only " +
                                std::to_string(columns));
  }
  if (!(std::fabs(cost) <= kLargestCost)) {
    throw std::invalid_argument("assign_sparse: the cost of entry " + std::to_string(k) +
                                " is not finite or above 1e300 in magnitude; leave the entry out "
                                "or divide all costs by a power of 2");
  }
}

/// `visit` calls its argument with the row, column and cost of each edge, and with the same edges
/// each time.
template <class Visit>
EdgeLists make_lists(std::size_t rows, std::size_t columns, std::size_t count, const Visit& visit) {
  EdgeLists lists;
  lists.columns = columns;
  lists.begin.assign(rows + 1, 0);
  lists.edges.resize(count);
  visit([&](std::uint32_t row, std::uint32_t, double) { ++lists.begin[row + 1]; });
  for (std::size_t i = 0; i < rows; ++i) lists.begin[i + 1] += lists.begin[i];
  std::vector<std::size_t> next(lists.begin.begin(), lists.begin.end() - 1);
  visit([&](std::uint32_t row, std::uint32_t column, double cost) {
    lists.edges[next[row]++] = {column, cost};
  });
  return lists;
}

EdgeLists transposed(const EdgeLists& lists) {
  return make_lists(lists.columns, lists.rows(), lists.edges.size(), [&](const auto& take) {
    for (std::size_t i = 0; i < lists.rows(); ++i) {
      for (const Candidate& c : lists.candidates(i))
        take(c.column, static_cast<std::uint32_t>(i), c.cost);
    }
  });
}

EdgeLists lists_of(const SparseCosts& costs) {
  if (costs.begin.empty() || costs.begin.front() != 0 ||
      costs.begin.back() != costs.column.size() || costs.column.size() != costs.cost.size()) {
    throw std::invalid_argument(
        "assign_sparse: the offsets must be rows + 1 numbers from 0 to the number of entries, and "
        "columns and costs must be equally many");
  }
  const std::size_t rows = costs.begin.size() - 1;
  check_sizes(rows, costs.columns);
  for (std::size_t i = 0; i < rows; ++i) {
    if (costs.begin[i] > costs.begin[i + 1]) {
      throw std::invalid_argument("assign_sparse: the offset of row " + std::to_string(i) +
                                  " is above the next one");
    }
  }
  EdgeLists lists;
  lists.columns = costs.columns;
  lists.begin.assign(costs.begin.begin(), costs.begin.end());
  lists.edges.reserve(costs.cost.size());
  for (std::size_t k = 0; k < costs.cost.size(); ++k) {
    check_edge(k, costs.column[k], costs.columns, costs.cost[k]);
    lists.edges.push_back({costs.column[k], costs.cost[k]});
  }
  return lists;
}

EdgeLists lists_of(std::span<const CostEdge> edges, std::size_t rows, std::size_t columns) {
  check_sizes(rows, columns);
  for (std::size_t k = 0; k < edges.size(); ++k) {
    if (edges[k].row >= rows) {
      throw std::invalid_argument("assign_sparse: entry " + std::to_string(k) + " has row " +
                                  std::to_string(edges[k].row) + ", but there are only " +
                                  std::to_string(rows));
    }
    check_edge(k, edges[k].column, columns, edges[k].cost);
  }
  return make_lists(rows, columns, edges.size(), [&](const auto& take) {
    for (const CostEdge& e : edges) take(e.row, e.column, e.cost);
  });
}

/// Finds the cheapest of the row's edges to this column. Returns false if there is no such edge.
bool chosen_cost(const EdgeLists& lists, std::size_t row, std::uint32_t column, double& cost) {
  bool has_cost = false;
  for (const Candidate& c : lists.candidates(row)) {
    if (c.column != column || (has_cost && !(c.cost < cost))) continue;
    cost = c.cost;
    has_cost = true;
  }
  return has_cost;
}

Assignment solve_wide(EdgeLists& lists, const char* side, const base::StopCheck& check_stop) {
  SparseSolver<EdgeLists> solver(lists.rows(), lists.columns, lists, check_stop);
  if (!solver.solve()) {
    const std::vector<std::uint32_t> tree = solver.tree_rows();
    const bool row = side[0] == 'r';
    throw std::invalid_argument(
        std::string("assign_sparse: no assignment: ") + side + " " + std::to_string(tree[0]) +
        (tree.size() == 1 ? std::string(" has no entry")
                          : " and " + std::to_string(tree.size() - 1) + " more " + side +
                                "s have entries in only " + std::to_string(tree.size() - 1) +
                                (row ? " columns" : " rows")) +
        "; give more entries");
  }
  return solver.result();
}

Assignment solve(EdgeLists lists, const base::StopCheck& check_stop) {
  Assignment result;
  if (lists.rows() <= lists.columns) {
    result = solve_wide(lists, "row", check_stop);
  } else {
    EdgeLists wide = transposed(lists);
    Assignment transposed_result = solve_wide(wide, "column", check_stop);
    result.column.assign(lists.rows(), kUnassigned);
    for (std::size_t j = 0; j < lists.columns; ++j)
      result.column[transposed_result.column[j]] = static_cast<std::uint32_t>(j);
    result.row_dual = std::move(transposed_result.column_dual);
    result.column_dual = std::move(transposed_result.row_dual);
  }
  for (std::size_t i = 0; i < lists.rows(); ++i) {
    double cost = 0;
    if (chosen_cost(lists, i, result.column[i], cost)) result.cost += cost;
  }
  return result;
}

double check_lists(const Assignment& assignment, const EdgeLists& lists) {
  OptimalityCheck<double> optimality(assignment, lists.rows(), lists.columns);
  for (std::size_t i = 0; i < lists.rows(); ++i) {
    const std::uint32_t column = assignment.column[i];
    double cost = 0;
    const bool has_cost = chosen_cost(lists, i, column, cost);
    if (!has_cost && column != kUnassigned) {
      throw std::invalid_argument("check: row " + std::to_string(i) +
                                  " has a column that is not among its entries");
    }
    if (has_cost) optimality.add_entry(i, column, cost);
    for (const Candidate& c : lists.candidates(i)) {
      if (c.column != column) optimality.add_entry(i, c.column, c.cost);
    }
  }
  return optimality.worst();
}

}  // namespace

Assignment assign_sparse(const SparseCosts& costs, const base::StopCheck& check_stop) {
  return solve(lists_of(costs), check_stop);
}

Assignment assign_sparse(std::span<const CostEdge> edges, std::size_t rows, std::size_t columns,
                         const base::StopCheck& check_stop) {
  return solve(lists_of(edges, rows, columns), check_stop);
}

double check(const Assignment& assignment, const SparseCosts& costs) {
  return check_lists(assignment, lists_of(costs));
}

double check(const Assignment& assignment, std::span<const CostEdge> edges, std::size_t rows,
             std::size_t columns) {
  return check_lists(assignment, lists_of(edges, rows, columns));
}

}  // namespace terrace::matching
