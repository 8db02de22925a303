// SPDX-License-Identifier: Apache-2.0
#include "facility/bounds/lagrangian.hpp"

#include <algorithm>

namespace terrace::cluster {

double ascend(DualFunction& function, std::vector<double>& duals, double target,
              const LowerBoundOptions& options) {
  const std::size_t patience = std::clamp<std::size_t>(options.steps / 30, 4, 30);
  constexpr double kShortest = 1e-4;
  // The fraction of the previous direction that a direction keeps. Without it the duals would
  // oscillate between two facilities.
  constexpr double kMemory = 0.7;
  const std::size_t n = duals.size();
  std::vector<double> now = duals, slope(n), direction(n, 0.0);
  DualValue value = function.evaluate(now, slope);
  double best = value.safe();
  double length = 1.0;
  std::size_t idle = 0;
  for (std::size_t k = 0; k < options.steps && best < target * (1.0 - 1e-13); ++k) {
    if (options.progress && !options.progress(k, options.steps)) break;
    double square = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      direction[i] = slope[i] + kMemory * direction[i];
      square += direction[i] * direction[i];
    }
    if (square == 0.0) break;
    const double step = length * std::max(target - value.value, 1e-9 * target) / square;
    for (std::size_t i = 0; i < n; ++i) now[i] += step * direction[i];
    function.clamp(now);
    value = function.evaluate(now, slope);
    if (value.safe() > best) {
      if (value.safe() > best + 1e-6 * (target - best)) idle = 0;
      best = value.safe();
      duals = now;
    }
    if (++idle < patience) continue;
    idle = 0;
    length *= 0.5;
    if (length < kShortest) break;
    now = duals;
    std::fill(direction.begin(), direction.end(), 0.0);
    value = function.evaluate(now, slope);
  }
  return best;
}

}  // namespace terrace::cluster
