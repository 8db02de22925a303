// SPDX-License-Identifier: Apache-2.0
#include "matrix_dual.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "parallel_blocks.hpp"

namespace terrace::cluster {
namespace {

constexpr std::size_t kBlock = 64;  // facilities

// Eight sums side by side: the order of addition is fixed, and a processor can do some at once.
double paid(const double* duals, const double* costs, std::size_t n) {
  std::array<double, 8> sums{};
  std::size_t i = 0;
  for (; i + 8 <= n; i += 8) {
    for (std::size_t lane = 0; lane < 8; ++lane) {
      const double left = duals[i + lane] - costs[i + lane];
      sums[lane] += left > 0.0 ? left : 0.0;
    }
  }
  for (; i < n; ++i) sums[i % 8] += std::max(0.0, duals[i] - costs[i]);
  return ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
}

}  // namespace

RowDual::RowDual(const CostRows& costs, std::span<const double> opening,
                 std::span<const double> ceiling, unsigned threads)
    : costs_(&costs),
      opening_(opening),
      ceiling_(ceiling),
      threads_(threads),
      floor_(costs.clients(), std::numeric_limits<double>::infinity()),
      paid_(costs.facilities()) {
  std::vector<double> scratch;
  for (std::size_t j = 0; j < costs.facilities(); ++j) {
    const double* const row = costs.row(j, scratch);
    for (std::size_t i = 0; i < floor_.size(); ++i) floor_[i] = std::min(floor_[i], row[i]);
  }
  for (std::size_t i = 0; i < ceiling_.size(); ++i) floor_[i] = std::min(floor_[i], ceiling_[i]);
}

DualValue RowDual::evaluate(std::span<const double> duals, std::span<double> slope) {
  const std::size_t m = costs_->facilities(), n = costs_->clients();
  parallel_blocks((m + kBlock - 1) / kBlock, threads_, [&](std::size_t block) {
    std::vector<double> scratch;
    for (std::size_t j = block * kBlock; j < std::min(m, (block + 1) * kBlock); ++j) {
      paid_[j] = paid(duals.data(), costs_->row(j, scratch), n);
    }
  });
  DualSum sum(n);
  for (std::size_t i = 0; i < n; ++i) {
    sum.client(duals[i]);
    slope[i] = 1.0;
  }
  std::vector<double> scratch;
  for (std::size_t j = 0; j < m; ++j) {
    sum.facility(opening_[j], paid_[j]);
    if (!(paid_[j] > opening_[j])) continue;
    const double* const row = costs_->row(j, scratch);
    for (std::size_t i = 0; i < n; ++i) slope[i] -= duals[i] > row[i] ? 1.0 : 0.0;
  }
  return sum.value();
}

void RowDual::clamp(std::span<double> duals) const {
  for (std::size_t i = 0; i < duals.size(); ++i) {
    duals[i] = std::max(duals[i], floor_[i]);
    if (!ceiling_.empty()) duals[i] = std::min(duals[i], ceiling_[i]);
  }
}

}  // namespace terrace::cluster
