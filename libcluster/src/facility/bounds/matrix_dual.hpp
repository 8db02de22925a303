// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "facility/bounds/lagrangian.hpp"
#include "facility/matrix/cost_rows.hpp"

namespace terrace::cluster {

/// L(v) of a problem whose rows are stored or computed one by one. An evaluation takes O(facilities
/// * clients).
class RowDual final : public DualFunction {
 public:
  /// `ceiling`: the most that each client pays (the price of leaving it out), or empty.
  RowDual(const CostRows& costs, std::span<const double> opening, std::span<const double> ceiling,
          unsigned threads);

  DualValue evaluate(std::span<const double> duals, std::span<double> slope) override;
  void clamp(std::span<double> duals) const override;
  /// Returns the cheapest connection of each client. Smaller duals make no sense.
  [[nodiscard]] std::span<const double> floor() const { return floor_; }

 private:
  const CostRows* costs_;
  std::span<const double> opening_, ceiling_;
  unsigned threads_;
  std::vector<double> floor_, paid_;
};

/// Returns L(v), rounded down so that no solution costs less, or 0 if it would be negative. Takes
/// O(facilities * clients).
/// Throws: std::invalid_argument as check() does, if there is not one dual per client, or if a dual
/// is not finite (the message names the client).
[[nodiscard]] double dual_value(const FacilityMatrix& problem, std::span<const double> duals,
                                const base::StopCheck& check_stop = {});

/// L of k-median. Facilities cost nothing, and the k that are paid most are open:
///     L(v) = sum_i v_i - sum of the k greatest of sum_i max(0, v_i - c_ij).
class MedianDual final : public DualFunction {
 public:
  MedianDual(const CostRows& costs, std::size_t k, unsigned threads);

  DualValue evaluate(std::span<const double> duals, std::span<double> slope) override;
  void clamp(std::span<double> duals) const override;

 private:
  const CostRows* costs_;
  std::size_t k_;
  unsigned threads_;
  std::vector<double> paid_;
  std::vector<std::uint32_t> order_;
};

}  // namespace terrace::cluster
