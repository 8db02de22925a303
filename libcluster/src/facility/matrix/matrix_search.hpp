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

/// One solution under local search. At least one facility is always open.
class MatrixSearch {
 public:
  /// `candidates`: facilities that may open; empty: all.
  MatrixSearch(const CostRows& costs, std::span<const double> opening,
               std::span<const std::uint32_t> candidates = {});

  void reset(std::span<const std::uint32_t> open);
  /// To be called after a change of the opening costs.
  void reprice() { update_cost(); }
  /// Descends to a local optimum; candidates are tried in random order.
  void descend(std::mt19937_64& random);
  /// Closes and opens about `strength` random facilities each.
  void perturb(std::uint32_t strength, std::mt19937_64& random);

  [[nodiscard]] double cost() const { return cost_; }
  [[nodiscard]] const NearestOpen& state() const { return state_; }

  /// The saving (if positive) from opening the closed `candidate` together with the closings that
  /// go best with it. Fills closings(). O(clients + open).
  double gain(std::uint32_t candidate);
  /// The closings chosen by gain().
  [[nodiscard]] std::span<const std::uint32_t> closings() const { return closings_; }
  /// Carries out the change evaluated by gain().
  void open(std::uint32_t candidate);
  /// Closes facilities one after the other, each time the one that saves most, as long as one does.
  /// Returns whether any was closed.
  bool drop();

 private:
  void update_cost();

  const CostRows* costs_;
  std::span<const double> opening_;
  NearestOpen state_;
  double cost_ = 0.0;
  // By facility: the cost of closing it beside the candidate if its clients go to the second
  // nearest or the candidate; and if they may go to the candidate alone.
  std::vector<std::array<double, 2>> closing_;
  std::vector<std::uint32_t> closings_;
  std::vector<std::uint32_t> order_;
  std::vector<double> scratch_;
};

}  // namespace terrace::cluster
