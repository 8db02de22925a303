// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/assignment.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "assignment/input_check.hpp"
#include "assignment/scan_kernels.hpp"

namespace terrace::matching {
namespace {

/// Shortest augmenting paths on a matrix whose rows come from `Rows`: rows(i) returns a pointer to
/// the costs of row i, which is valid until the next call.
///
/// Labels of columns start at 0 and only fall, and only for columns that have a row. When all
/// columns have a row and rows remain, labels are shifted so that the labels of rows are at most 0.
/// From then on a path may also end at a row, which then gives up its column.
template <class Cost, class Rows>
class DenseSolver {
 public:
  using Sum = CostSum<Cost>;

  /// check_stop: must outlive this object.
  DenseSolver(std::size_t rows, std::size_t columns, Rows& source,
              const base::StopCheck& check_stop)
      : rows_(rows),
        columns_(columns),
        source_(source),
        ticks_(check_stop),
        kernels_(scan_kernels<Cost>()),
        row_of_(columns, kUnassigned),
        distance_(columns),
        previous_(columns),
        block_least_((columns + kScanBlock - 1) / kScanBlock) {
    result_.column.assign(rows, kUnassigned);
    result_.row_dual.assign(rows, 0);
    result_.column_dual.assign(columns, 0);
  }

  BasicAssignment<Sum> solve() {
    const std::size_t first = std::min(rows_, columns_);
    if (columns_ != 0) {
      for (const std::uint32_t row : reduce_rows(first)) augment(row);
      if (rows_ > columns_) {
        shift_labels(first);
        may_unassign_ = true;
        for (std::size_t i = first; i < rows_; ++i) augment(static_cast<std::uint32_t>(i));
      }
    }
    for (std::size_t i = 0; i < rows_; ++i) {
      const std::uint32_t j = result_.column[i];
      if (j != kUnassigned) result_.cost += static_cast<Sum>(source_(i)[j]);
    }
    return std::move(result_);
  }

 private:
  struct Settled {
    std::uint32_t column;
    Sum distance, label;
  };

  /// Returns the first column of `costs` with this value of cost - label, preferably one without a
  /// row.
  std::uint32_t column_at(const Cost* costs, Sum value, bool prefer_free,
                          std::uint32_t excluded) const {
    std::uint32_t first = kUnassigned;
    for (std::size_t j = 0; j < columns_; ++j) {
      if (static_cast<Sum>(costs[j]) - result_.column_dual[j] != value || j == excluded) continue;
      if (!prefer_free || row_of_[j] == kUnassigned) return static_cast<std::uint32_t>(j);
      if (first == kUnassigned) first = static_cast<std::uint32_t>(j);
    }
    return first;
  }

  /// Augmenting row reduction: a row takes its best column, and the column's label falls until the
  /// second best is as good. A row that loses its column searches again. With real costs the steps
  /// get ever smaller, so their number is bounded. Returns the rows that remain.
  std::vector<std::uint32_t> reduce_rows(std::size_t count) {
    std::vector<std::uint32_t> unassigned;
    std::size_t steps = kReductionSteps * count;
    for (std::size_t i = 0; i < count; ++i) {
      std::uint32_t row = static_cast<std::uint32_t>(i);
      while (row != kUnassigned) {
        ticks_(columns_);
        const Cost* costs = source_(row);
        Sum least, second;
        kernels_.least_two(costs, result_.column_dual.data(), columns_, &least, &second);
        result_.row_dual[row] = least;
        std::uint32_t column = column_at(costs, least, least == second, kUnassigned);
        const std::uint32_t owner = row_of_[column];
        const bool free = owner == kUnassigned;
        if (!free && (steps == 0 || !(least < second))) {
          unassigned.push_back(row);
          break;
        }
        if (steps != 0) --steps;
        if (columns_ > 1 && least < second) {
          const Sum label = result_.column_dual[column] - (second - least);
          // Rounding can absorb the difference. Further steps would then make no progress.
          if (!free && !(label < result_.column_dual[column])) {
            unassigned.push_back(row);
            break;
          }
          result_.column_dual[column] = label;
          result_.row_dual[row] = static_cast<Sum>(costs[column]) - label;
        }
        row_of_[column] = row;
        result_.column[row] = column;
        if (!free) result_.column[owner] = kUnassigned;
        row = owner;
      }
    }
    return unassigned;
  }

  /// Shifts all labels so that the labels of rows are at most 0.
  void shift_labels(std::size_t count) {
    Sum highest = result_.row_dual[0];
    for (std::size_t i = 1; i < count; ++i) highest = std::max(highest, result_.row_dual[i]);
    for (std::size_t i = 0; i < count; ++i) result_.row_dual[i] -= highest;
    for (Sum& label : result_.column_dual) label += highest;
  }

  /// Returns the first column at the least distance, preferably one without a row.
  std::uint32_t nearest_column(Sum least) const {
    std::uint32_t first = kUnassigned;
    for (std::size_t b = 0; b < block_least_.size(); ++b) {
      if (block_least_[b] != least) continue;
      const std::size_t end = std::min(columns_, (b + 1) * kScanBlock);
      for (std::size_t j = b * kScanBlock; j < end; ++j) {
        if (distance_[j] != least) continue;
        if (row_of_[j] == kUnassigned) return static_cast<std::uint32_t>(j);
        if (first == kUnassigned) first = static_cast<std::uint32_t>(j);
      }
    }
    return first;
  }

  /// Gives row `start` a column by the shortest augmenting path, or leaves one row unassigned if
  /// that is cheaper and allowed.
  void augment(std::uint32_t start) {
    std::fill(distance_.begin(), distance_.end(), kUnreachable<Sum>);
    settled_.clear();
    auto& labels = result_.column_dual;
    std::uint32_t row = start, sink = kUnassigned, released_row = kUnassigned;
    Sum path_length = 0, release_distance = kUnreachable<Sum>;
    if (may_unassign_) {
      released_row = start;
      release_distance = -result_.row_dual[start];
    }
    for (;;) {
      ticks_(columns_);
      const Sum base = path_length - result_.row_dual[row];
      const Sum least = kernels_.relax(source_(row), labels.data(), columns_, base, row,
                                       distance_.data(), previous_.data(), block_least_.data());
      if (may_unassign_ && base < release_distance) {
        release_distance = base;
        released_row = row;
      }
      if (may_unassign_ && release_distance <= least) {
        path_length = release_distance;
        break;
      }
      path_length = least;
      const std::uint32_t j = nearest_column(least);
      if (row_of_[j] == kUnassigned) {
        sink = j;
        break;
      }
      settled_.push_back({j, least, labels[j]});
      labels[j] = kSettled<Sum>;
      distance_[j] = kUnreachable<Sum>;
      row = row_of_[j];
    }
    // Labels of the tree's rows rise and labels of its columns fall, which makes the path's edges
    // tight.
    result_.row_dual[start] += path_length;
    for (const Settled& s : settled_) {
      const Sum decrease = path_length - s.distance;
      result_.row_dual[row_of_[s.column]] += decrease;
      labels[s.column] = s.label - decrease;
    }
    std::uint32_t j = sink;
    if (sink == kUnassigned) {
      j = std::exchange(result_.column[released_row], kUnassigned);
      result_.row_dual[released_row] = 0;
      if (released_row == start) return;
    }
    for (;;) {
      const auto i = static_cast<std::uint32_t>(previous_[j]);
      row_of_[j] = i;
      std::swap(result_.column[i], j);
      if (i == start) break;
    }
  }

  static constexpr std::size_t kReductionSteps = 4;

  std::size_t rows_, columns_;
  Rows& source_;
  base::StopTicks ticks_;
  const ScanKernels<Cost>& kernels_;
  bool may_unassign_ = false;
  BasicAssignment<Sum> result_;
  std::vector<std::uint32_t> row_of_;
  std::vector<Sum> distance_;
  std::vector<std::int64_t> previous_;
  std::vector<Sum> block_least_;
  std::vector<Settled> settled_;
};

template <class Cost>
BasicAssignment<CostSum<Cost>> assign_matrix(std::span<const Cost> costs, std::size_t rows,
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
  std::size_t buffered_row = rows;
  const auto row = [&](std::size_t i) {
    if (i != buffered_row) {
      fill_row(i, buffer);
      check_row<double>(buffer, i);
      buffered_row = i;
    }
    return static_cast<const double*>(buffer.data());
  };
  return DenseSolver<double, decltype(row)>(rows, columns, row, {}).solve();
}

}  // namespace terrace::matching
