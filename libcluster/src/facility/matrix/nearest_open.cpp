// SPDX-License-Identifier: Apache-2.0
#include "facility/matrix/nearest_open.hpp"

#include <cassert>
#include <limits>

namespace terrace::cluster {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

NearestOpen::NearestOpen(const CostRows& costs)
    : costs_(&costs),
      position_(costs.facilities(), kNone),
      first_(costs.clients(), kNone),
      second_(costs.clients(), kNone),
      first_cost_(costs.clients(), kInfinity),
      second_cost_(costs.clients(), kInfinity) {}

void NearestOpen::reset(std::span<const std::uint32_t> open) {
  for (const std::uint32_t j : open_) position_[j] = kNone;
  open_.clear();
  first_.assign(first_.size(), kNone);
  second_.assign(second_.size(), kNone);
  first_cost_.assign(first_.size(), kInfinity);
  second_cost_.assign(first_.size(), kInfinity);
  for (const std::uint32_t j : open) this->open(j);
}

void NearestOpen::open(std::uint32_t facility) {
  assert(!is_open(facility));
  position_[facility] = static_cast<std::uint32_t>(open_.size());
  open_.push_back(facility);
  take(facility);
}

void NearestOpen::take(std::uint32_t facility) {
  const double* const costs = costs_->row(facility, scratch_);
  for (std::size_t i = 0; i < first_.size(); ++i) {
    if (!(costs[i] < second_cost_[i])) continue;
    if (costs[i] < first_cost_[i]) {
      second_[i] = first_[i];
      second_cost_[i] = first_cost_[i];
      first_[i] = facility;
      first_cost_[i] = costs[i];
    } else {
      second_[i] = facility;
      second_cost_[i] = costs[i];
    }
  }
}

void NearestOpen::close(std::uint32_t facility) {
  assert(is_open(facility));
  const std::uint32_t hole = position_[facility];
  open_[hole] = open_.back();
  position_[open_[hole]] = hole;
  open_.pop_back();
  position_[facility] = kNone;

  orphans_.clear();
  for (std::uint32_t i = 0; i < first_.size(); ++i) {
    if (first_[i] == facility) {
      first_[i] = second_[i];
      first_cost_[i] = second_cost_[i];
    } else if (second_[i] != facility) {
      continue;
    }
    second_[i] = kNone;
    second_cost_[i] = kInfinity;
    orphans_.push_back(i);
  }
  gathered_.resize(orphans_.size());
  for (const std::uint32_t j : open_) {
    costs_->gather(j, orphans_, gathered_.data());
    for (std::size_t k = 0; k < orphans_.size(); ++k) {
      const std::uint32_t i = orphans_[k];
      if (gathered_[k] < second_cost_[i] && first_[i] != j) {
        second_[i] = j;
        second_cost_[i] = gathered_[k];
      }
    }
  }
}

double NearestOpen::connection_cost() const {
  double sum = 0.0;
  for (const double c : first_cost_) sum += c;
  return sum;
}

}  // namespace terrace::cluster
