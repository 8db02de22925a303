// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "terrace/matching/assignment.hpp"

namespace terrace::matching {

inline void check_sizes(std::size_t rows, std::size_t columns) {
  if (rows >= kUnassigned || columns >= kUnassigned) {
    throw std::invalid_argument("assign: " + std::to_string(rows) + " rows and " +
                                std::to_string(columns) +
                                " columns: both must be below 2^32 - 1; split the problem");
  }
}

/// Throws std::invalid_argument that names the first entry that is not finite or too large.
template <class Cost>
void check_row(std::span<const Cost> costs, std::size_t row) {
  if constexpr (std::is_floating_point_v<Cost>) {
    unsigned bad = 0;
    for (const Cost c : costs) bad |= !(std::fabs(static_cast<double>(c)) <= kLargestCost);
    if (bad == 0) return;
    std::size_t j = 0;
    while (std::fabs(static_cast<double>(costs[j])) <= kLargestCost) ++j;
    throw std::invalid_argument(
        "assign: the entry at row " + std::to_string(row) + ", column " + std::to_string(j) +
        (std::isfinite(costs[j]) ? " is above 1e300 in magnitude; divide all costs by a power of 2"
                                 : " is not finite; for pairs that must not be chosen use "
                                   "assign_sparse or a high cost"));
  }
}

template <class Cost>
void check_matrix(std::span<const Cost> costs, std::size_t rows, std::size_t columns) {
  check_sizes(rows, columns);
  // Both are below 2^32, so the product does not overflow.
  if (costs.size() != rows * columns) {
    throw std::invalid_argument("assign: the matrix has " + std::to_string(costs.size()) +
                                " entries, not rows * columns = " + std::to_string(rows) + " * " +
                                std::to_string(columns));
  }
  for (std::size_t i = 0; i < rows; ++i) check_row(costs.subspan(i * columns, columns), i);
}

}  // namespace terrace::matching
