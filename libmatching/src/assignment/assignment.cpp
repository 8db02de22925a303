// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/assignment.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "assignment/dense_solver.hpp"
#include "assignment/input_check.hpp"

namespace terrace::matching {
namespace {

template <class Cost>
BasicAssignment<LabelOf<Cost>> assign_matrix(std::span<const Cost> costs, std::size_t rows,
                                             std::size_t columns,
                                             const base::StopCheck& check_stop) {
  check_matrix(costs, rows, columns);
  const auto row = [&](std::size_t i) { return costs.data() + i * columns; };
  return DenseSolver<Cost, decltype(row)>(rows, columns, row, check_stop).solve();
}

}  // namespace

Assignment assign(std::span<const double> costs, std::size_t rows, std::size_t columns,
                  const base::StopCheck& check_stop) {
  return assign_matrix(costs, rows, columns, check_stop);
}

Assignment assign(std::span<const float> costs, std::size_t rows, std::size_t columns,
                  const base::StopCheck& check_stop) {
  return assign_matrix(costs, rows, columns, check_stop);
}

IntegerAssignment assign(std::span<const std::int32_t> costs, std::size_t rows, std::size_t columns,
                         const base::StopCheck& check_stop) {
  return assign_matrix(costs, rows, columns, check_stop);
}

Assignment assign_rows(std::size_t rows, std::size_t columns, const CostRow& fill_row) {
  check_sizes(rows, columns);
  std::vector<double> buffer(columns);
  std::size_t held = rows;
  const auto row = [&](std::size_t i) {
    if (i != held) {
      fill_row(i, buffer);
      check_row<double>(buffer, i);
      held = i;
    }
    return static_cast<const double*>(buffer.data());
  };
  return DenseSolver<double, decltype(row)>(rows, columns, row, {}).solve();
}

}  // namespace terrace::matching
