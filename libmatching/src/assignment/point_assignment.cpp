// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/point_assignment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "assignment/check_optimal.hpp"
#include "assignment/column_tree.hpp"
#include "assignment/input_check.hpp"
#include "assignment/sparse_solver.hpp"

namespace terrace::matching {
namespace {

/// Number of columns that a row starts with, and roughly how many it gets at a time later.
constexpr std::size_t kFirstCandidates = 12, kMoreCandidates = 32;

template <std::size_t D>
using Points = std::vector<std::array<double, D>>;

/// Returns the larger of `largest` and the largest magnitude of a coordinate. Throws for bad
/// points.
template <std::size_t D>
double magnitude(std::span<const std::array<double, D>> points, const char* set, double largest) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const double x : points[i]) {
      if (!(std::fabs(x) <= kLargestCost)) {
        throw std::invalid_argument(std::string("assign_points: point ") + std::to_string(i) +
                                    " of the " + set +
                                    " has a coordinate that is not finite or above 1e300 in "
                                    "magnitude; leave it out, or divide all by a power of 2");
      }
      largest = std::max(largest, std::fabs(x));
    }
  }
  return largest;
}

/// Scales both sets by the same power of two, which is exact, so that squares neither overflow nor
/// underflow.
template <std::size_t D>
struct Scaled {
  int exponent = 0;
  Points<D> rows, columns;

  Scaled(std::span<const std::array<double, D>> r, std::span<const std::array<double, D>> c)
      : rows(r.begin(), r.end()), columns(c.begin(), c.end()) {
    check_sizes(r.size(), c.size());
    const double largest = magnitude<D>(c, "columns", magnitude<D>(r, "rows", 0.0));
    if (largest > 0) std::frexp(largest, &exponent);
    for (Points<D>* points : {&rows, &columns}) {
      for (auto& p : *points) {
        for (double& x : p) x = std::ldexp(x, -exponent);
      }
    }
  }
  /// Converts a length of the scaled points back to the unit of the input.
  double unscale(double value) const { return std::ldexp(value, exponent); }
};

/// The lists of candidates for SparseSolver, filled from a tree of the columns.
template <std::size_t D>
class NearCandidates {
 public:
  static constexpr bool kComplete = true;

  NearCandidates(const Points<D>& rows, ColumnTree<D>& tree, std::size_t columns)
      : rows_(rows), tree_(tree), lists_(rows.size()), threshold_(rows.size()) {
    const std::vector<double> labels(columns, 0.0);
    const double no_limit = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < rows.size(); ++i)
      threshold_[i] = tree_.nearest(rows[i], labels, kFirstCandidates, no_limit, lists_[i]);
    step_ = threshold_;
    // Keeps steps finite if a row has all columns from the start, and positive if all its first
    // columns are at distance 0.
    for (double& step : step_) step = step > 0 ? std::min(step, 1.0) : 0.01;
  }

  std::span<const Candidate> candidates(std::size_t row) const { return lists_[row]; }
  double threshold(std::size_t row) const { return threshold_[row]; }

  std::size_t extend(std::size_t row, const std::vector<double>& labels, double limit) {
    std::vector<Candidate>& list = lists_[row];
    std::erase_if(list,
                  [&](const Candidate& c) { return c.cost - labels[c.column] > threshold_[row]; });
    const std::size_t previous_size = list.size(), count = std::max(kMoreCandidates, previous_size);
    for (const Candidate& c : list) tree_.exclude(c.column);
    // If many columns are equally near, the number of columns limits the batch. Otherwise the
    // distance does.
    const double search_limit = std::min(limit, threshold_[row] + step_[row]);
    const double reached = tree_.nearest(rows_[row], labels, count, search_limit, list);
    // A step that adds no column grows, because rounding may have swallowed it.
    if (list.size() == previous_size) step_[row] *= 2;
    threshold_[row] = std::max(threshold_[row], reached);
    return previous_size;
  }
  Candidate nearest_free(std::size_t row) const { return tree_.nearest_free(rows_[row]); }
  void on_label_decrease(const std::vector<double>& labels, std::uint32_t column) {
    tree_.update_label(labels, column);
  }
  void on_assigned(std::uint32_t column) { tree_.mark_taken(column); }

 private:
  const Points<D>& rows_;
  ColumnTree<D>& tree_;
  std::vector<std::vector<Candidate>> lists_;
  std::vector<double> threshold_, step_;
};

/// Requires rows.size() <= columns.size(). Does not compute the cost.
template <std::size_t D>
Assignment assign_wide(const Points<D>& rows, const Points<D>& columns,
                       const base::StopCheck& check_stop) {
  ColumnTree<D> tree(columns);
  NearCandidates<D> source(rows, tree, columns.size());
  SparseSolver<NearCandidates<D>> solver(rows.size(), columns.size(), source, check_stop);
  // Every column can be reached from every row, so a path always exists.
  solver.solve();
  Assignment result = solver.result();
  for (std::uint32_t& j : result.column) j = tree.original(j);
  std::vector<double> labels(columns.size());
  for (std::uint32_t j = 0; j < columns.size(); ++j)
    labels[tree.original(j)] = result.column_dual[j];
  result.column_dual = std::move(labels);
  return result;
}

template <std::size_t D>
Assignment assign_sets(std::span<const std::array<double, D>> rows,
                       std::span<const std::array<double, D>> columns,
                       const base::StopCheck& check_stop) {
  const Scaled<D> scaled(rows, columns);
  Assignment result;
  if (rows.size() <= columns.size()) {
    result = assign_wide<D>(scaled.rows, scaled.columns, check_stop);
  } else {
    Assignment transposed_result = assign_wide<D>(scaled.columns, scaled.rows, check_stop);
    result.column.assign(rows.size(), kUnassigned);
    for (std::size_t j = 0; j < columns.size(); ++j)
      result.column[transposed_result.column[j]] = static_cast<std::uint32_t>(j);
    result.row_dual = std::move(transposed_result.column_dual);
    result.column_dual = std::move(transposed_result.row_dual);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (result.column[i] == kUnassigned) continue;
    result.cost +=
        scaled.unscale(distance_between(scaled.rows[i], scaled.columns[result.column[i]]));
  }
  for (auto* labels : {&result.row_dual, &result.column_dual}) {
    for (double& label : *labels) label = scaled.unscale(label);
  }
  return result;
}

template <std::size_t D>
double check_sets(const Assignment& assignment, std::span<const std::array<double, D>> rows,
                  std::span<const std::array<double, D>> columns) {
  const Scaled<D> scaled(rows, columns);
  OptimalityCheck<double> optimality(assignment, rows.size(), columns.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t j = 0; j < columns.size(); ++j)
      optimality.add_entry(i, j,
                           scaled.unscale(distance_between(scaled.rows[i], scaled.columns[j])));
  }
  return optimality.worst();
}

}  // namespace

Assignment assign_points(std::span<const Point2> rows, std::span<const Point2> columns,
                         const base::StopCheck& check_stop) {
  return assign_sets<2>(rows, columns, check_stop);
}

Assignment assign_points(std::span<const Point3> rows, std::span<const Point3> columns,
                         const base::StopCheck& check_stop) {
  return assign_sets<3>(rows, columns, check_stop);
}

double check_points(const Assignment& assignment, std::span<const Point2> rows,
                    std::span<const Point2> columns) {
  return check_sets<2>(assignment, rows, columns);
}

double check_points(const Assignment& assignment, std::span<const Point3> rows,
                    std::span<const Point3> columns) {
  return check_sets<3>(assignment, rows, columns);
}

}  // namespace terrace::matching
