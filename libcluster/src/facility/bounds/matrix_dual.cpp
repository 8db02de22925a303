// SPDX-License-Identifier: Apache-2.0
#include "facility/bounds/matrix_dual.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include <terrace/base/parallel.hpp>

namespace terrace::cluster {
namespace {

constexpr std::size_t kFacilitiesPerBlock = 64;

// Adds up eight parallel sums. The order of addition is fixed, and a processor can do several at
// once.
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

void add_up(const CostRows& costs, std::span<const double> duals, unsigned threads,
            std::vector<double>& sums) {
  const std::size_t m = costs.facilities(), n = costs.clients();
  base::parallel_for((m + kFacilitiesPerBlock - 1) / kFacilitiesPerBlock, threads,
                     [&](std::size_t block) {
                       std::vector<double> scratch;
                       for (std::size_t j = block * kFacilitiesPerBlock;
                            j < std::min(m, (block + 1) * kFacilitiesPerBlock); ++j) {
                         sums[j] = paid(duals.data(), costs.row(j, scratch), n);
                       }
                     });
}

void count_payers(std::span<const double> duals, const double* costs, std::span<double> slope) {
  for (std::size_t i = 0; i < duals.size(); ++i) slope[i] -= duals[i] > costs[i] ? 1.0 : 0.0;
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
  add_up(*costs_, duals, threads_, paid_);
  DualSum sum(n);
  for (std::size_t i = 0; i < n; ++i) {
    sum.client(duals[i]);
    slope[i] = 1.0;
  }
  std::vector<double> scratch;
  for (std::size_t j = 0; j < m; ++j) {
    sum.facility(opening_[j], paid_[j]);
    if (!(paid_[j] > opening_[j])) continue;
    count_payers(duals, costs_->row(j, scratch), slope);
  }
  return sum.value();
}

void RowDual::clamp(std::span<double> duals) const {
  for (std::size_t i = 0; i < duals.size(); ++i) {
    duals[i] = std::max(duals[i], floor_[i]);
    if (!ceiling_.empty()) duals[i] = std::min(duals[i], ceiling_[i]);
  }
}

MedianDual::MedianDual(const CostRows& costs, std::size_t k, unsigned threads)
    : costs_(&costs),
      k_(k),
      threads_(threads),
      paid_(costs.facilities()),
      order_(costs.facilities()) {
  std::iota(order_.begin(), order_.end(), 0u);
}

DualValue MedianDual::evaluate(std::span<const double> duals, std::span<double> slope) {
  add_up(*costs_, duals, threads_, paid_);
  std::sort(order_.begin(), order_.end(), [this](std::uint32_t a, std::uint32_t b) {
    return paid_[a] > paid_[b] || (paid_[a] == paid_[b] && a < b);
  });
  DualSum sum(costs_->clients());
  for (std::size_t i = 0; i < duals.size(); ++i) {
    sum.client(duals[i]);
    slope[i] = 1.0;
  }
  // Rounding may have omitted a facility that is paid more than the least of them, but by no more
  // than the uncertainty of the sums.
  std::vector<double> scratch;
  for (std::size_t r = 0; r < k_; ++r) {
    sum.facility(0.0, paid_[order_[r]]);
    count_payers(duals, costs_->row(order_[r], scratch), slope);
  }
  return sum.value();
}

void MedianDual::clamp(std::span<double> duals) const {
  for (double& v : duals) v = std::max(v, 0.0);
}

}  // namespace terrace::cluster
