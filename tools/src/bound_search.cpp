// SPDX-License-Identifier: GPL-3.0-or-later
#include "bound_search.hpp"

#include <algorithm>
#include <cmath>

namespace terrace::tools {

double search_bound(const BoundSearch& search,
                    const std::function<std::uint64_t(double bound)>& run) {
  constexpr int kMostRuns = 24;
  constexpr double kLeastStep = 1.002;
  const auto most = static_cast<double>(search.most);
  // Bounds between which the answer lies, and the number of vertices at the larger.
  double many_bound = 0.0, few_bound = -1.0, few = 0.0, last = -1.0;
  bool many_known = false;
  double bound = std::min(search.start, search.range);
  for (int round = 0; round < kMostRuns; ++round) {
    const std::uint64_t vertices = run(bound);
    last = bound;
    if (vertices <= search.most) {
      few_bound = bound;
      few = static_cast<double>(vertices);
      if (bound == 0.0 || few >= 0.98 * most) break;
    } else {
      if (bound >= search.range) return -1.0;
      many_bound = bound;
      many_known = true;
    }
    if (few_bound < 0.0) {
      // Guesses are off by little, so at first steps are small.
      bound = std::min(search.range, bound * (round < 2 ? 1.1 : 4.0));
      continue;
    }
    if (many_bound > 0.0 && few_bound / many_bound < kLeastStep) break;
    if (few_bound < 1e-6 * search.range && !many_known) {
      bound = 0.0;
      continue;
    }
    // The number falls about as the inverse of the bound, or more slowly or faster.
    const double wanted = few_bound * std::max(few, 1.0) / (0.99 * most);
    const double middle = many_bound > 0.0 ? std::sqrt(few_bound * many_bound) : few_bound / 4.0;
    bound = std::min(std::max(wanted, middle), few_bound / kLeastStep);
  }
  if (few_bound >= 0.0 && last != few_bound) run(few_bound);
  return few_bound;
}

}  // namespace terrace::tools
