// SPDX-License-Identifier: Apache-2.0
#include "facility/matrix/matrix_search.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

#include <terrace/base/random.hpp>

namespace terrace::cluster {

// Gains below this fraction of the cost are rounding. Without this limit a search might cycle.
constexpr double kMinGain = 1e-12;

MatrixSearch::MatrixSearch(const CostRows& costs, std::span<const double> opening,
                           std::span<const std::uint32_t> candidates)
    : costs_(&costs),
      opening_(opening),
      state_(costs),
      closing_(costs.facilities()),
      order_(candidates.begin(), candidates.end()) {
  if (!order_.empty()) return;
  order_.resize(costs.facilities());
  std::iota(order_.begin(), order_.end(), 0u);
}

void MatrixSearch::reset(std::span<const std::uint32_t> open) {
  assert(!open.empty());
  state_.reset(open);
  update_cost();
}

void MatrixSearch::update_cost() {
  cost_ = state_.connection_cost();
  for (const std::uint32_t j : state_.facilities()) cost_ += opening_[j];
}

double MatrixSearch::gain(std::uint32_t candidate) {
  assert(!state_.is_open(candidate));
  for (const std::uint32_t j : state_.facilities()) closing_[j] = {0.0, 0.0};
  const double* const costs = costs_->row(candidate, scratch_);
  const double* const first = state_.first_cost().data();
  const double* const second = state_.second_cost().data();
  const std::uint32_t* const facility = state_.first().data();
  double saving = -opening_[candidate];
  for (std::size_t i = 0, n = costs_->clients(); i < n; ++i) {
    const double c = costs[i];
    const double now = std::min(c, first[i]);
    saving += first[i] - now;
    auto& closing = closing_[facility[i]];
    closing[0] += std::min(c, second[i]) - now;
    closing[1] += c - now;
  }
  // Either one facility closes and its clients use the second nearest, or any number of them close
  // and all their clients go to the candidate.
  double best_one = 0.0, all = 0.0;
  std::uint32_t one = NearestOpen::kNone;
  for (const std::uint32_t j : state_.facilities()) {
    const double spare = opening_[j] - closing_[j][0];
    if (spare > best_one) {
      best_one = spare;
      one = j;
    }
    all += std::max(0.0, opening_[j] - closing_[j][1]);
  }
  closings_.clear();
  if (all > best_one) {
    for (const std::uint32_t j : state_.facilities()) {
      if (opening_[j] > closing_[j][1]) closings_.push_back(j);
    }
  } else if (one != NearestOpen::kNone) {
    closings_.push_back(one);
  }
  return saving + std::max(all, best_one);
}

void MatrixSearch::open(std::uint32_t candidate) {
  state_.open(candidate);
  for (const std::uint32_t j : closings_) state_.close(j);
  update_cost();
}

bool MatrixSearch::drop() {
  bool dropped = false;
  while (state_.facilities().size() > 1) {
    for (const std::uint32_t j : state_.facilities()) closing_[j][0] = 0.0;
    for (std::size_t i = 0, n = costs_->clients(); i < n; ++i) {
      closing_[state_.first()[i]][0] += state_.second_cost()[i] - state_.first_cost()[i];
    }
    double best = kMinGain * cost_;
    std::uint32_t worst = NearestOpen::kNone;
    for (const std::uint32_t j : state_.facilities()) {
      const double spare = opening_[j] - closing_[j][0];
      if (spare > best) {
        best = spare;
        worst = j;
      }
    }
    if (worst == NearestOpen::kNone) break;
    state_.close(worst);
    update_cost();
    dropped = true;
  }
  return dropped;
}

void MatrixSearch::descend(std::mt19937_64& random) {
  drop();
  base::shuffle(order_, random);
  // Ends when every candidate has been rejected since the last change.
  std::size_t refused = 0;
  for (std::size_t k = 0; refused < order_.size(); k = (k + 1) % order_.size()) {
    const std::uint32_t candidate = order_[k];
    ++refused;
    if (state_.is_open(candidate) || !(gain(candidate) > kMinGain * cost_)) continue;
    open(candidate);
    drop();
    refused = 0;
  }
}

void MatrixSearch::perturb(std::uint32_t strength, std::mt19937_64& random) {
  for (std::uint32_t s = 0; s < strength; ++s) {
    const std::uint32_t candidate = base::draw_below(costs_->facilities(), random);
    if (!state_.is_open(candidate)) state_.open(candidate);
    if (state_.facilities().size() < 2) continue;
    const std::uint32_t leaving =
        state_.facilities()[base::draw_below(state_.facilities().size(), random)];
    if (leaving != candidate) state_.close(leaving);
  }
  update_cost();
}

}  // namespace terrace::cluster
