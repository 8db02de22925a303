// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

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
/// look(row) returns an Offer. fell(column) is called after the column's label fell. The labels
/// must be feasible at the start for some row labels, as 0 is. They stay feasible because they only
/// fall.
template <class Number, class Look, class Fell>
void bid(std::size_t rows, std::vector<Number>& labels, const Look& look, const Fell& fell) {
  // With few rows the trees are small anyway, and without bidding simple numbers stay simple.
  constexpr std::size_t kFewRows = 100, kRounds = 5, kBidsPerRow = 20;
  // The first minimum raise, as a multiple of the mean distance between a row's two best columns.
  constexpr Number kFirstRaise = 10;
  if (rows < kFewRows) return;
  Number gaps = 0;
  for (std::size_t i = 0; i < rows; ++i) {
    const Offer<Number> offer = look(static_cast<std::uint32_t>(i));
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
        const Offer<Number> offer = look(row);
        labels[offer.column] -= (offer.second - offer.least) + raise;
        fell(offer.column);
        row = std::exchange(row_of[offer.column], row);
      }
    }
  }
}

}  // namespace terrace::matching
