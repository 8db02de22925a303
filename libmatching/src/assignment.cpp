// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/assignment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace terrace::matching {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

void check(std::span<const double> costs, std::size_t rows, std::size_t columns) {
  if (rows > columns) {
    throw std::invalid_argument("assign: more rows (" + std::to_string(rows) + ") than columns (" +
                                std::to_string(columns) + "); transpose the matrix");
  }
  if (columns != 0 && rows > std::numeric_limits<std::size_t>::max() / columns) {
    throw std::invalid_argument("assign: rows * columns overflows");
  }
  if (costs.size() != rows * columns) {
    throw std::invalid_argument("assign: the matrix has " + std::to_string(costs.size()) +
                                " entries, not rows * columns = " + std::to_string(rows * columns));
  }
  for (std::size_t k = 0; k < costs.size(); ++k) {
    if (!std::isfinite(costs[k])) {
      throw std::invalid_argument("assign: the entry at row " + std::to_string(k / columns) +
                                  ", column " + std::to_string(k % columns) + " is not finite");
    }
  }
}

}  // namespace

Assignment assign(std::span<const double> costs, std::size_t rows, std::size_t columns) {
  check(costs, rows, columns);
  Assignment result;
  result.column.assign(rows, kNone);
  result.row_dual.assign(rows, 0.0);
  result.column_dual.assign(columns, 0.0);
  std::vector<std::uint32_t> row_of(columns, kNone);
  std::vector<std::uint32_t> previous_row(columns);
  std::vector<double> distance(columns);
  // Columns in [0, settled) have their final distance; those before `frontier` are in the tree.
  std::vector<std::uint32_t> order(columns);

  for (std::size_t start = 0; start < rows; ++start) {
    for (std::size_t j = 0; j < columns; ++j) order[j] = static_cast<std::uint32_t>(j);
    std::fill(distance.begin(), distance.end(), std::numeric_limits<double>::infinity());
    std::size_t settled = 0;
    auto row = static_cast<std::uint32_t>(start);
    double reached = 0.0;
    std::uint32_t sink = kNone;
    // Dijkstra over reduced costs from `start` to the nearest free column.
    while (sink == kNone) {
      const double* row_costs = costs.data() + static_cast<std::size_t>(row) * columns;
      const double base = reached - result.row_dual[row];
      std::size_t nearest = settled;
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t k = settled; k < columns; ++k) {
        const std::uint32_t j = order[k];
        const double through = base + row_costs[j] - result.column_dual[j];
        if (through < distance[j]) {
          distance[j] = through;
          previous_row[j] = row;
        }
        // Among equally near columns a free one ends the search at once.
        if (distance[j] < least || (distance[j] == least && row_of[j] == kNone)) {
          least = distance[j];
          nearest = k;
        }
      }
      reached = least;
      const std::uint32_t j = order[nearest];
      std::swap(order[nearest], order[settled]);
      ++settled;
      if (row_of[j] == kNone) {
        sink = j;
      } else {
        row = row_of[j];
      }
    }
    // Labels: rows of the tree rise, its columns fall, so that the path's edges become tight.
    result.row_dual[start] += reached;
    for (std::size_t k = 0; k + 1 < settled; ++k) {
      const std::uint32_t j = order[k];
      result.row_dual[row_of[j]] += reached - distance[j];
      result.column_dual[j] -= reached - distance[j];
    }
    // Augment along the path.
    for (std::uint32_t j = sink;;) {
      const std::uint32_t i = previous_row[j];
      row_of[j] = i;
      std::swap(result.column[i], j);
      if (i == start) break;
    }
  }
  for (std::size_t i = 0; i < rows; ++i) result.cost += costs[i * columns + result.column[i]];
  return result;
}

}  // namespace terrace::matching
