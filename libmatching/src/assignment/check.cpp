// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include "assignment/check_optimal.hpp"
#include "assignment/input_check.hpp"
#include "assignment/scan_kernels.hpp"
#include "terrace/matching/assignment.hpp"

namespace terrace::matching {
namespace {

template <class Cost>
CostSum<Cost> check_all(const BasicAssignment<CostSum<Cost>>& assignment,
                        std::span<const Cost> costs, std::size_t rows, std::size_t columns) {
  check_matrix(costs, rows, columns);
  OptimalityCheck<CostSum<Cost>> optimality(assignment, rows, columns);
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t j = 0; j < columns; ++j) optimality.add_entry(i, j, costs[i * columns + j]);
  }
  return optimality.worst();
}

}  // namespace

double check(const Assignment& assignment, std::span<const double> costs, std::size_t rows,
             std::size_t columns) {
  return check_all(assignment, costs, rows, columns);
}

double check(const Assignment& assignment, std::span<const float> costs, std::size_t rows,
             std::size_t columns) {
  return check_all(assignment, costs, rows, columns);
}

std::int64_t check(const IntegerAssignment& assignment, std::span<const std::int32_t> costs,
                   std::size_t rows, std::size_t columns) {
  return check_all(assignment, costs, rows, columns);
}

double check_rows(const Assignment& assignment, std::size_t rows, std::size_t columns,
                  const CostRow& fill_row) {
  check_sizes(rows, columns);
  OptimalityCheck<double> optimality(assignment, rows, columns);
  std::vector<double> costs(columns);
  for (std::size_t i = 0; i < rows; ++i) {
    fill_row(i, costs);
    check_row<double>(costs, i);
    for (std::size_t j = 0; j < columns; ++j) optimality.add_entry(i, j, costs[j]);
  }
  return optimality.worst();
}

}  // namespace terrace::matching
