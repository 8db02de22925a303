// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "terrace/tri/view.hpp"

namespace terrace::tri {

/// What a step needs to spend; all times are of StepBudget::clock.
class StepMeter {
 public:
  void start(const StepBudget& budget);
  /// Whether one more operation on this many points fits. The first one always does.
  [[nodiscard]] bool has(std::size_t points) const;
  /// Call it after each operation.
  void spend(std::size_t points);
  /// Call it before the first operation, and at the end of the step.
  void ready() { last_ = now(); }
  void end();

 private:
  [[nodiscard]] double now() const { return timed_ ? budget_->clock() : 0.0; }

  const StepBudget* budget_ = nullptr;
  bool timed_ = false;
  double begin_ = 0.0, last_ = 0.0;
  std::size_t operations_ = 0, points_ = 0;
  // Seconds per point of operations and of the end, as in the steps before.
  double operation_rate_ = 0.0, end_rate_ = 0.0;
};

}  // namespace terrace::tri
