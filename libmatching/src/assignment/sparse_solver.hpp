// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/matching/assignment.hpp"

namespace terrace::matching {

/// A row's bid: the column with the least cost - label, that least value, and the second least. The
/// second is at least as large, and equal to the least if there is no other column.
template <class Number>
struct Offer {
  std::uint32_t column;
  Number least, second;
};

/// Computes initial labels where rows and columns are equally many. The rows bid for columns as in
/// an auction (D. Bertsekas, "The auction algorithm", 1988), in rounds with a decreasing minimum
/// raise. The rounds only bring the labels near the optimal ones, so that the following searches
/// grow small trees. The proof does not depend on them, and the number of bids is bounded.
///
/// best_offer(row) returns the Offer of a row. on_decrease(column) is called after the column's
/// label decreased. The labels must be feasible at the start for some row labels, as 0 is. They
/// stay feasible because they only fall.
template <class Number, class Look, class Fell>
void bid(std::size_t rows, std::vector<Number>& labels, const Look& best_offer,
         const Fell& on_decrease) {
  // With few rows the trees are small anyway, and without bidding simple numbers stay simple.
  constexpr std::size_t kFewRows = 100, kRounds = 5, kBidsPerRow = 20;
  // The first minimum raise, as a multiple of the mean distance between a row's two best columns.
  constexpr Number kFirstRaise = 10;
  if (rows < kFewRows) return;
  Number gaps = 0;
  for (std::size_t i = 0; i < rows; ++i) {
    const Offer<Number> offer = best_offer(static_cast<std::uint32_t>(i));
    gaps += (offer.second - offer.least) / static_cast<Number>(rows);
  }
  Number raise = kFirstRaise * gaps;
  std::vector<std::uint32_t> row_of(labels.size());
  for (std::size_t round = 0; round < kRounds && raise > 0; ++round, raise = raise * 3 / 10) {
    std::fill(row_of.begin(), row_of.end(), kUnassigned);
    std::size_t bids = kBidsPerRow * rows;
    for (std::size_t i = 0; i < rows && bids != 0; ++i) {
      auto row = static_cast<std::uint32_t>(i);
      for (; row != kUnassigned && bids != 0; --bids) {
        const Offer<Number> offer = best_offer(row);
        labels[offer.column] -= (offer.second - offer.least) + raise;
        on_decrease(offer.column);
        row = std::exchange(row_of[offer.column], row);
      }
    }
  }
}

/// A column that a row may get, and the cost of the pair.
struct Candidate {
  std::uint32_t column;
  double cost;
};

/// Shortest augmenting paths on lists of candidates. Requires rows <= columns.
///
/// `Source` holds the lists:
///   kComplete: whether every row can reach every column, listed or not;
///   std::span<const Candidate> candidates(row): the list, which only extend() changes;
///   double threshold(row): lower bound of cost - label for columns that are not in the list;
///   size_t extend(row, labels, limit): raises the threshold, at most to `limit`, and adds the
///     columns below it to the list, from the returned position on. Columns that are not below the
///     old threshold may leave the list;
///   Candidate nearest_free(row): some near free column, or kUnassigned if it knows none;
///   void on_label_decrease(labels, column): called after a label decreased;
///   void on_assigned(column): called when a column gets its first row.
/// Labels of columns start at 0 and only fall. With rows < columns, they fall only for columns that
/// have a row.
template <class Source>
class SparseSolver {
 public:
  /// check_stop: must outlive this object.
  SparseSolver(std::size_t rows, std::size_t columns, Source& source,
               const base::StopCheck& check_stop)
      : rows_(rows),
        source_(source),
        ticks_(check_stop),
        row_of_(columns, kUnassigned),
        previous_(columns),
        distance_(columns, kInfinity),
        row_distance_(rows) {
    result_.column.assign(rows, kUnassigned);
    result_.row_dual.assign(rows, 0.0);
    result_.column_dual.assign(columns, 0.0);
  }

  /// Returns false if a row has no path to a free column. result() is then invalid, and tree_rows()
  /// are rows that together reach only tree_rows().size() - 1 columns.
  bool solve() {
    if (Source::kComplete && rows_ == row_of_.size()) {
      bid(
          rows_, result_.column_dual, [&](std::uint32_t row) { return offer(row); },
          [&](std::uint32_t column) { source_.on_label_decrease(result_.column_dual, column); });
    }
    for (const std::uint32_t row : reduce_rows()) {
      if (!augment(row)) return false;
    }
    return true;
  }

  /// Returns the assignment without its cost.
  Assignment result() { return std::move(result_); }

  std::vector<std::uint32_t> tree_rows() const {
    std::vector<std::uint32_t> rows{start_};
    for (const Settled& s : settled_) rows.push_back(row_of_[s.column]);
    return rows;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  static constexpr std::size_t kReductionSteps = 16;

  struct Settled {
    std::uint32_t column;
    double distance;
  };
  /// A column at its distance, or a row at the distance from which its absent columns matter.
  struct Event {
    double key;
    std::uint32_t id;
    bool row;
    // std::push_heap keeps the largest element in front. Ties have a fixed order.
    bool operator<(const Event& other) const {
      if (key != other.key) return key > other.key;
      if (row != other.row) return row;
      return id > other.id;
    }
  };

  Offer<double> offer(std::uint32_t row) {
    for (;;) {
      ticks_(source_.candidates(row).size());
      Offer<double> best{kUnassigned, kInfinity, source_.threshold(row)};
      for (const Candidate& c : source_.candidates(row)) {
        const double reduced = c.cost - result_.column_dual[c.column];
        if (reduced < best.least) {
          best.second = std::min(best.second, best.least);
          best.least = reduced;
          best.column = c.column;
        } else {
          best.second = std::min(best.second, reduced);
        }
      }
      if (best.second == kInfinity) best.second = best.least;
      if (best.least <= best.second) return best;
      // The best column may be absent from the list.
      source_.extend(row, result_.column_dual, kInfinity);
    }
  }

  /// Augmenting row reduction as in DenseSolver. The threshold stands in for all columns that are
  /// not candidates.
  std::vector<std::uint32_t> reduce_rows() {
    std::vector<std::uint32_t> unassigned;
    auto& labels = result_.column_dual;
    std::size_t steps = kReductionSteps * rows_;
    for (std::size_t i = 0; i < rows_; ++i) {
      auto row = static_cast<std::uint32_t>(i);
      while (row != kUnassigned) {
        ticks_(source_.candidates(row).size());
        double least = kInfinity, second = source_.threshold(row), cost = 0;
        std::uint32_t column = kUnassigned;
        for (const Candidate& c : source_.candidates(row)) {
          const double reduced = c.cost - labels[c.column];
          if (reduced < least || (reduced == least && row_of_[column] != kUnassigned)) {
            if (c.column != column) second = std::min(second, least);
            least = reduced;
            column = c.column;
            cost = c.cost;
          } else if (c.column != column) {
            second = std::min(second, reduced);
          }
        }
        result_.row_dual[row] = std::min(least, second);
        if (column == kUnassigned || second < least) {
          if (column == kUnassigned && second == kInfinity) result_.row_dual[row] = 0.0;
          unassigned.push_back(row);
          break;
        }
        const std::uint32_t owner = row_of_[column];
        const double label =
            second == kInfinity ? labels[column] : labels[column] - (second - least);
        if (owner != kUnassigned && (steps == 0 || !(label < labels[column]))) {
          unassigned.push_back(row);
          break;
        }
        if (steps != 0) --steps;
        if (label < labels[column]) {
          labels[column] = label;
          result_.row_dual[row] = cost - label;
          source_.on_label_decrease(labels, column);
        }
        row_of_[column] = row;
        result_.column[row] = column;
        if (owner == kUnassigned) {
          source_.on_assigned(column);
        } else {
          result_.column[owner] = kUnassigned;
        }
        row = owner;
      }
    }
    return unassigned;
  }

  void reach_free(std::uint32_t row, std::uint32_t column, double distance) {
    bound_ = distance;
    sink_ = column;
    sink_row_ = row;
  }

  void push(Event event) {
    heap_.push_back(event);
    std::push_heap(heap_.begin(), heap_.end());
  }

  /// Relaxes the row's candidates from `first` on. Absent columns matter if they are below `limit`.
  void relax(std::uint32_t row, std::size_t first, double limit) {
    const double base = row_distance_[row] - result_.row_dual[row];
    ticks_(source_.candidates(row).size());
    for (const Candidate& c : source_.candidates(row).subspan(first)) {
      const double through = (base + c.cost) - result_.column_dual[c.column];
      if (!(through < bound_) || !(through < distance_[c.column])) continue;
      if (row_of_[c.column] == kUnassigned) {
        reach_free(row, c.column, through);
        continue;
      }
      if (distance_[c.column] == kInfinity) touched_.push_back(c.column);
      distance_[c.column] = through;
      previous_[c.column] = row;
      push({through, c.column, false});
    }
    const double unlisted = base + source_.threshold(row);
    if (source_.threshold(row) < limit && unlisted < bound_) push({unlisted, row, true});
  }

  bool augment(std::uint32_t start) {
    for (const std::uint32_t j : touched_) distance_[j] = kInfinity;
    touched_.clear();
    settled_.clear();
    heap_.clear();
    start_ = start;
    bound_ = kInfinity;
    sink_ = kUnassigned;
    auto& labels = result_.column_dual;
    const Candidate free = source_.nearest_free(start);
    if (free.column != kUnassigned)
      reach_free(start, free.column, free.cost - result_.row_dual[start] - labels[free.column]);
    row_distance_[start] = 0.0;
    relax(start, 0, kInfinity);
    while (!heap_.empty() && heap_.front().key < bound_) {
      std::pop_heap(heap_.begin(), heap_.end());
      const Event event = heap_.back();
      heap_.pop_back();
      if (event.row) {
        const double limit = bound_ - row_distance_[event.id] + result_.row_dual[event.id];
        relax(event.id, source_.extend(event.id, labels, limit), limit);
        continue;
      }
      if (distance_[event.id] != event.key) continue;
      settled_.push_back({event.id, event.key});
      // Marks the column as settled: no distance is below this.
      distance_[event.id] = -kInfinity;
      const std::uint32_t row = row_of_[event.id];
      row_distance_[row] = event.key;
      relax(row, 0, kInfinity);
    }
    if (sink_ == kUnassigned) return false;
    // Labels of the tree's rows rise and labels of its columns fall, which makes the path's edges
    // tight.
    result_.row_dual[start] += bound_;
    for (const Settled& s : settled_) {
      const double decrease = bound_ - s.distance;
      result_.row_dual[row_of_[s.column]] += decrease;
      labels[s.column] -= decrease;
      source_.on_label_decrease(labels, s.column);
    }
    source_.on_assigned(sink_);
    std::uint32_t j = sink_;
    for (std::uint32_t i = sink_row_;;) {
      row_of_[j] = i;
      std::swap(result_.column[i], j);
      if (i == start) break;
      i = previous_[j];
    }
    return true;
  }

  std::size_t rows_;
  Source& source_;
  base::StopTicks ticks_;
  Assignment result_;
  std::vector<std::uint32_t> row_of_, previous_;
  std::vector<double> distance_, row_distance_;
  std::vector<std::uint32_t> touched_;
  std::vector<Settled> settled_;
  std::vector<Event> heap_;
  std::uint32_t start_ = 0, sink_ = kUnassigned, sink_row_ = 0;
  double bound_ = kInfinity;
};

}  // namespace terrace::matching
