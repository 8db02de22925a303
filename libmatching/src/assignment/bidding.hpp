// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "terrace/matching/assignment.hpp"

namespace terrace::matching {

/// The least cost - label of a row, its column, and the second least (at least as large; equal if
/// there is no other column).
template <class Number>
struct Offer {
  std::uint32_t column;
  Number least, second;
};

/// Initial labels where rows and columns are equally many: the rows bid for columns as in an
/// auction (D. Bertsekas, "The auction algorithm", 1988), in rounds with a decreasing minimum
/// raise. The rounds only bring the labels near the optimal ones, so that the following searches
/// grow small trees; the proof does not rest on them, and the number of bids is bounded.
///
/// look(row): an Offer;  fell(column): its label fell. Labels must be feasible at the start for
/// some labels of rows, as 0 is, and remain so because they only fall.
template <class Number, class Look, class Fell>
void bid(std::size_t rows, std::vector<Number>& labels, const Look& look, const Fell& fell) {
  // Few rows have small trees anyway; and results with simple numbers stay simple.
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
