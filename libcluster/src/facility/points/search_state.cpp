// SPDX-License-Identifier: Apache-2.0
#include "facility/points/search_state.hpp"

#include <cassert>
#include <cmath>
#include <utility>

namespace terrace::cluster {

SearchState::SearchState(SearchFrame& frame)
    : weight_(std::move(frame.weights)),
      facility_cost_(frame.facility_cost),
      outlier_price_(frame.outlier_price),
      true_facility_cost_(frame.true_facility_cost),
      cost_exponent_(frame.cost_exponent) {}

double SearchState::unscaled(double cost) const { return std::ldexp(cost, cost_exponent_); }

double SearchState::cost() const {
  double cost = static_cast<double>(open_.size()) * facility_cost_;
  for (std::size_t i = 0; i < size(); ++i) cost += weight_[i] * distance_[i];
  return cost;
}

void SearchState::sum(Move& move) const {
  double gain = is_open(move.candidate) ? 0.0 : -facility_cost_;
  auto term = move.reassigned.begin();
  const auto add_terms_of = [&](std::uint32_t facility) {
    double saving = 0.0;
    for (; term != move.reassigned.end() && term->facility() == facility; ++term) {
      saving += term->saving;
    }
    gain += saving;
  };
  for (const Move::Closing& closing : move.closings) {
    while (term != move.reassigned.end() && term->facility() <= closing.facility) {
      add_terms_of(term->facility());
    }
    gain += closing.saving;
  }
  while (term != move.reassigned.end()) add_terms_of(term->facility());
  move.gain = gain;
}

void SearchState::assign(std::vector<std::uint32_t> facility, std::vector<double> distance) {
  facility_ = std::move(facility);
  distance_ = std::move(distance);
  open_.clear();
  outliers_.clear();
  clusters_.clear();
  free_slots_.clear();
  slot_.assign(size(), kClosed);
  for (std::uint32_t i = 0; i < size(); ++i) {
    if (facility_[i] == i) open_facility(i);
  }
  for (std::uint32_t i = 0; i < size(); ++i) {
    if (facility_[i] == kOutlier) {
      outliers_.push_back(i);
    } else {
      assert(is_open(facility_[i]));
      clusters_[slot_[facility_[i]]].clients.push_back(i);
    }
  }
  for (const std::uint32_t j : open_) sum_up(clusters_[slot_[j]]);
}

void SearchState::connect(std::uint32_t client, std::uint32_t facility, double distance) {
  facility_[client] = facility;
  distance_[client] = distance;
}

void SearchState::open_facility(std::uint32_t facility) {
  if (is_open(facility)) return;
  open_.insert(std::lower_bound(open_.begin(), open_.end(), facility), facility);
  if (free_slots_.empty()) {
    slot_[facility] = static_cast<std::uint32_t>(clusters_.size());
    clusters_.emplace_back();
  } else {
    slot_[facility] = free_slots_.back();
    free_slots_.pop_back();
  }
}

void SearchState::close_facility(std::uint32_t facility) {
  open_.erase(std::lower_bound(open_.begin(), open_.end(), facility));
  clusters_[slot_[facility]].clients.clear();
  free_slots_.push_back(slot_[facility]);
  slot_[facility] = kClosed;
}

void SearchState::remove_lost_clients(std::uint32_t facility) {
  Cluster& cluster = clusters_[slot_[facility]];
  std::erase_if(cluster.clients, [&](std::uint32_t i) { return facility_[i] != facility; });
  sum_up(cluster);
}

void SearchState::sum_up(Cluster& cluster) const {
  cluster.weight = cluster.cost = cluster.longest = 0.0;
  for (const std::uint32_t i : cluster.clients) {
    cluster.weight += weight_[i];
    cluster.cost += weight_[i] * distance_[i];
    cluster.longest = std::max(cluster.longest, distance_[i]);
  }
}

FacilitySolution SearchState::solution() const {
  FacilitySolution solution;
  solution.facilities = open_;
  std::vector<std::uint32_t> number(size(), kOutlier);
  for (std::uint32_t c = 0; c < open_.size(); ++c) number[open_[c]] = c;
  solution.assignment.reserve(size());
  double connections = 0.0, prices = 0.0;
  for (std::size_t i = 0; i < size(); ++i) {
    const bool connected = facility_[i] != kOutlier;
    solution.assignment.push_back(connected ? number[facility_[i]] : kOutlier);
    (connected ? connections : prices) += weight_[i] * distance_[i];
  }
  solution.opening_cost = static_cast<double>(open_.size()) * true_facility_cost_;
  solution.connection_cost = unscaled(connections);
  solution.outlier_cost = unscaled(prices);
  return solution;
}

}  // namespace terrace::cluster
