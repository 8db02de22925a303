// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "terrace/tri/view.hpp"

namespace terrace::tri {
namespace {

// The estimate rises fast and falls slowly, as a step must not last longer than its budget. A
// measurement disturbed by other programs counts as at most twice the usual value.
void update_estimate(double& rate, double measured) {
  if (rate > 0.0) measured = std::min(measured, 2.0 * rate);
  rate += (measured - rate) * (rate == 0.0 ? 1.0 : measured > rate ? 0.25 : 0.0625);
}

// Share of the budget to plan for. Actual times scatter around the estimate, and steps with more
// than enough work should end within the budget too.
constexpr double kPlannedShare = 0.95;

// Adds the part of the cost of each operation, and of the end of a step, that does not depend on
// the number of points.
double with_overhead(std::size_t points) { return static_cast<double>(points) + 16.0; }

std::size_t total(const std::array<std::size_t, StepMeter::kKinds>& points) {
  return std::accumulate(points.begin(), points.end(), std::size_t{0});
}

}  // namespace

void StepMeter::start(const StepBudget& budget) {
  timed_ = std::isfinite(budget.seconds);
  if (std::isnan(budget.seconds) || (timed_ && !budget.clock)) {
    throw std::invalid_argument("step budget: finite seconds need a clock");
  }
  budget_ = &budget;
  operations_ = 0;
  points_ = {};
  fixed_done_ = false;
  begin_ = last_ = now();
}

bool StepMeter::fits(std::size_t points, std::size_t kind) const {
  if (operations_ >= budget_->operations) return false;
  if (!timed_) return true;
  // Thinning adds as well as removes.
  const auto after = [&](std::size_t of) {
    return of == kLoad ? 0.0 : budget_->after[of == kCollapse ? 1 : 0];
  };
  double predicted = with_overhead(points) * operation_rate_[kind] +
                     with_overhead(total(points_) + points) * end_rate_ +
                     with_overhead(points) * after(kind) + (fixed_done_ ? 0.0 : fixed_);
  for (std::size_t k = 0; k < kKinds; ++k) predicted += static_cast<double>(points_[k]) * after(k);
  return last_ - begin_ + predicted < kPlannedShare * budget_->seconds;
}

void StepMeter::spend(std::size_t points, std::size_t kind) {
  ++operations_;
  points_[kind] += points;
  if (!timed_) return;
  const double previous = std::exchange(last_, now());
  update_estimate(operation_rate_[kind], (last_ - previous) / with_overhead(points));
  update_estimate(usual_points_[kind], static_cast<double>(points));
}

void StepMeter::end_fixed_work() {
  fixed_done_ = true;
  if (!timed_) return;
  const double previous = std::exchange(last_, now());
  update_estimate(fixed_, last_ - previous);
}

void StepMeter::end() {
  if (timed_ && operations_ > 0)
    update_estimate(end_rate_, (now() - last_) / with_overhead(total(points_)));
}

}  // namespace terrace::tri
