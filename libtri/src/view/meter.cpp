// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "terrace/tri/view.hpp"

namespace terrace::tri {
namespace {

// A new measurement counts an eighth, and one disturbed from outside at most twice the usual value.
void learn(double& rate, double measured) {
  if (rate > 0.0) measured = std::min(measured, 2.0 * rate);
  rate = rate > 0.0 ? rate + (measured - rate) / 8.0 : measured;
}

// A part of the cost of each operation, and of the end of a step, does not depend on the number of
// points.
double with_overhead(std::size_t points) { return static_cast<double>(points) + 16.0; }

}  // namespace

void StepMeter::start(const StepBudget& budget) {
  timed_ = std::isfinite(budget.seconds);
  if (std::isnan(budget.seconds) || (timed_ && !budget.clock)) {
    throw std::invalid_argument("step budget: finite seconds need a clock");
  }
  budget_ = &budget;
  operations_ = points_ = 0;
  begin_ = last_ = now();
}

bool StepMeter::has(std::size_t points) const {
  if (operations_ == 0) return true;
  if (operations_ >= budget_->operations) return false;
  if (!timed_) return true;
  const double ahead =
      with_overhead(points) * operation_rate_ + with_overhead(points_ + points) * end_rate_;
  return last_ - begin_ + ahead < budget_->seconds;
}

void StepMeter::spend(std::size_t points) {
  ++operations_;
  points_ += points;
  if (!timed_) return;
  const double before = std::exchange(last_, now());
  learn(operation_rate_, (last_ - before) / with_overhead(points));
  learn(usual_points_, static_cast<double>(points));
}

void StepMeter::end() {
  if (timed_ && operations_ > 0) learn(end_rate_, (now() - last_) / with_overhead(points_));
}

}  // namespace terrace::tri
