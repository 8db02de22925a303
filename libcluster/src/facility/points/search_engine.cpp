// SPDX-License-Identifier: Apache-2.0
#include "facility/points/search_engine.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include <terrace/base/parallel.hpp>
#include <terrace/base/random.hpp>
#include <terrace/base/stop_check.hpp>

namespace terrace::cluster {
namespace {

[[noreturn]] void refuse_start(const std::string& what) {
  throw std::invalid_argument("the start of the search: " + what);
}

}  // namespace

SearchEngine::SearchEngine(SearchFrame& frame, FacilityStrategy strategy, unsigned threads,
                           base::StopCheck check_stop)
    : strategy_(strategy),
      state_(frame),
      team_(base::threads_for(std::numeric_limits<std::size_t>::max(), threads)),
      check_stop_(std::move(check_stop)),
      moves_(1) {}

void SearchEngine::replace(std::vector<std::uint32_t> facility, std::vector<double> distance) {
  state_.assign(std::move(facility), std::move(distance));
  connections_replaced();
}

void SearchEngine::start(const FacilitySolution& solution) {
  const std::size_t count = state_.size();
  const double price = state_.outlier_price();
  if (solution.facilities.empty()) refuse_start("no facility is open");
  if (solution.assignment.size() != count) {
    refuse_start(std::to_string(solution.assignment.size()) + " assignments for " +
                 std::to_string(count) + " clients");
  }
  std::vector<std::uint32_t> facility(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t c = solution.assignment[i];
    if (c != kOutlier && c >= solution.facilities.size()) {
      refuse_start("client " + std::to_string(i) + " is in cluster " + std::to_string(c) +
                   ", but there are only " + std::to_string(solution.facilities.size()));
    }
    if (c == kOutlier && !std::isfinite(price)) {
      refuse_start("client " + std::to_string(i) + " is left out, but outliers have no price");
    }
    facility[i] = c == kOutlier ? kOutlier : solution.facilities[c];
  }
  for (const std::uint32_t j : solution.facilities) {
    if (j >= count) refuse_start("facility " + std::to_string(j) + " does not exist");
    facility[j] = j;
  }
  std::vector<double> distances(count, price);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (facility[i] == kOutlier) continue;
    const double d = facility[i] == i ? 0.0 : distance(facility[i], i);
    if (d > price) {
      facility[i] = kOutlier;
    } else {
      distances[i] = d;
    }
  }
  replace(std::move(facility), std::move(distances));
}

double SearchEngine::gain(std::uint32_t candidate) {
  assert(candidate < state_.size());
  evaluate(candidate, true, moves_[0]);
  return state_.unscaled(moves_[0].gain);
}

void SearchEngine::open(std::uint32_t candidate) {
  assert(candidate < state_.size());
  evaluate(candidate, true, moves_[0]);
  apply(moves_[0]);
}

bool SearchEngine::improve(std::size_t candidates, std::mt19937_64& random, std::size_t batch,
                           const FacilityProgress& progress) {
  assert(batch > 0);
  // Reports often enough that even a long search can be stopped soon.
  const std::size_t step = std::clamp<std::size_t>(candidates / 256, 1, 1000);
  std::size_t tried = 0, next_report = 0;
  while (tried < candidates) {
    if (progress && tried >= next_report) {
      if (!progress(tried, candidates)) return false;
      next_report = tried + step;
    }
    if (check_stop_) check_stop_();
    const std::size_t batch_size = std::min(batch, candidates - tried);
    if (moves_.size() < batch_size) moves_.resize(batch_size);
    for (std::size_t k = 0; k < batch_size; ++k) {
      moves_[k].candidate = base::draw_below(state_.size(), random);
    }
    if (batch_size == 1) {
      evaluate(moves_[0].candidate, true, moves_[0]);
    } else {
      team_.run(batch_size, [this](std::size_t k) {
        if (check_stop_) check_stop_();
        evaluate(moves_[k].candidate, false, moves_[k]);
      });
    }
    std::size_t positive = 0;
    const Move* best = nullptr;
    for (std::size_t k = 0; k < batch_size; ++k) {
      const Move& move = moves_[k];
      statistics_.inspected += move.inspected;
      if (!(move.gain > 0.0)) continue;
      ++positive;
      if (!best || move.gain > best->gain) best = &move;
    }
    statistics_.candidates += batch_size;
    statistics_.vertices += batch_size * (state_.size() + state_.open().size());
    statistics_.positive += positive;
    tried += batch_size - (positive > 1 ? positive - 1 : 0);
    if (best) {
      apply(*best);
      ++statistics_.opened;
    }
  }
  return !progress || progress(tried, candidates);
}

}  // namespace terrace::cluster
