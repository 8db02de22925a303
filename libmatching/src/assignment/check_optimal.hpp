// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "terrace/matching/assignment.hpp"

namespace terrace::matching {

/// Measures how far an assignment violates the conditions of optimality. See check().
template <class Number>
class OptimalityCheck {
 public:
  OptimalityCheck(const BasicAssignment<Number>& assignment, std::size_t rows, std::size_t columns)
      : assignment_(assignment) {
    if (assignment.column.size() != rows || assignment.row_dual.size() != rows ||
        assignment.column_dual.size() != columns) {
      throw std::invalid_argument("check: the sizes of the assignment do not match " +
                                  std::to_string(rows) + " rows and " + std::to_string(columns) +
                                  " columns");
    }
    std::vector<bool> used(columns, false);
    std::size_t count = 0;
    for (std::size_t i = 0; i < rows; ++i) {
      const std::uint32_t j = assignment.column[i];
      if (j == kUnassigned) {
        if (rows <= columns) fail(i, "has no column");
        require_zero(assignment.row_dual[i]);
        continue;
      }
      if (j >= columns) fail(i, "has a column out of range");
      if (used[j]) fail(i, "repeats the column of an earlier row");
      used[j] = true;
      ++count;
    }
    if (count != std::min(rows, columns)) {
      throw std::invalid_argument("check: only " + std::to_string(count) + " rows have a column");
    }
    if (rows <= columns) {
      for (const Number label : assignment.column_dual) require_nonpositive(label);
      for (std::size_t j = 0; j < columns; ++j) {
        if (!used[j]) require_zero(assignment.column_dual[j]);
      }
    } else {
      for (const Number label : assignment.row_dual) require_nonpositive(label);
    }
  }

  /// Checks one entry of the matrix. Every entry of a chosen pair must be added once.
  void add_entry(std::size_t i, std::size_t j, Number cost) {
    const Number slack = cost - assignment_.row_dual[i] - assignment_.column_dual[j];
    require_nonpositive(-slack);
    if (assignment_.column[i] == j) {
      require_zero(slack);
      sum_ += cost;
    }
  }

  /// Returns the largest violation so far, including that of the cost.
  Number worst() {
    require_zero(sum_ - assignment_.cost);
    return worst_;
  }

 private:
  [[noreturn]] static void fail(std::size_t row, const char* what) {
    throw std::invalid_argument("check: row " + std::to_string(row) + " " + what);
  }
  // `!(x <= y)` also catches NaN, which then stays in the result.
  void require_nonpositive(Number value) {
    if (worst_ == worst_ && !(value <= worst_)) worst_ = value;
  }
  void require_zero(Number value) { require_nonpositive(value < 0 ? -value : value); }

  const BasicAssignment<Number>& assignment_;
  Number worst_ = 0, sum_ = 0;
};

}  // namespace terrace::matching
