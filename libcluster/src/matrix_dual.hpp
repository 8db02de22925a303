// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "cost_rows.hpp"
#include "lagrangian.hpp"

namespace terrace::cluster {

/// L(v) of a problem whose rows are at hand, or worked out one by one. O(facilities * clients) per
/// evaluation.
class RowDual final : public DualFunction {
 public:
  /// `ceiling`: what a client pays at most (the price of leaving it out), or empty. `weights`: of
  /// the clients, for the slope; empty for 1 each.
  RowDual(const CostRows& costs, std::span<const double> opening, std::span<const double> ceiling,
          unsigned threads);

  DualValue evaluate(std::span<const double> duals, std::span<double> slope) override;
  void clamp(std::span<double> duals) const override;
  /// The cheapest connection of each client: no smaller dual makes sense.
  [[nodiscard]] std::span<const double> floor() const { return floor_; }

 private:
  const CostRows* costs_;
  std::span<const double> opening_, ceiling_;
  unsigned threads_;
  std::vector<double> floor_, paid_;
};

}  // namespace terrace::cluster
