// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "facility/matrix/cost_rows.hpp"
#include "facility/matrix/nearest_open.hpp"

namespace terrace::cluster {

/// A solution under local search. At least one facility is always open.
class MatrixSearch {
 public:
  /// candidates: the facilities that may open; if empty, all.
  MatrixSearch(const CostRows& costs, std::span<const double> opening,
               std::span<const std::uint32_t> candidates = {});

  void reset(std::span<const std::uint32_t> open);
  /// Must be called after the opening costs have changed.
  void reprice() { update_cost(); }
  /// Descends to a local optimum. Tries candidates in random order.
  void descend(std::mt19937_64& random);
  /// Closes about `strength` random facilities and opens as many.
  void perturb(std::uint32_t strength, std::mt19937_64& random);

  [[nodiscard]] double cost() const { return cost_; }
  [[nodiscard]] const NearestOpen& state() const { return state_; }

  /// Returns the saving (if positive) from opening the closed `candidate` together with the best
  /// set of closings. Fills closings(). Takes O(clients + open).
  double gain(std::uint32_t candidate);
  /// Returns the closings that gain() chose.
  [[nodiscard]] std::span<const std::uint32_t> closings() const { return closings_; }
  /// Makes the change that gain() evaluated.
  void open(std::uint32_t candidate);
  /// Closes facilities one by one, always the one that saves most, until none saves anything.
  /// Returns whether any was closed.
  bool drop();

 private:
  void update_cost();

  const CostRows* costs_;
  std::span<const double> opening_;
  NearestOpen state_;
  double cost_ = 0.0;
  // By facility: the cost of closing it when the candidate opens, if its clients go to the second
  // nearest or the candidate, and if they may go to the candidate only.
  std::vector<std::array<double, 2>> closing_;
  std::vector<std::uint32_t> closings_;
  std::vector<std::uint32_t> order_;
  std::vector<double> scratch_;
};

}  // namespace terrace::cluster
