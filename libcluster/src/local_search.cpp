// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/local_search.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "scaling.hpp"

namespace terrace::cluster {
namespace {

std::size_t ceil_log(std::size_t value, std::size_t base) {
  std::size_t exponent = 0;
  for (std::size_t power = 1; power < value; ++exponent) {
    if (power > value / base) return exponent + 1;
    power *= base;
  }
  return exponent;
}

// Own conversions: the distributions of the standard library differ between implementations.
double unit_double(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

std::uint32_t below(std::size_t bound, std::mt19937_64& random) {
  return static_cast<std::uint32_t>(((random() >> 32) * bound) >> 32);
}

}  // namespace

std::size_t candidate_count(SearchLength length, std::size_t points) {
  switch (length) {
    case SearchLength::tenth:
      return std::max<std::size_t>(points / 10, points > 0 ? 1 : 0);
    case SearchLength::log10_full:
      return points * std::max<std::size_t>(ceil_log(points, 10), 1);
    case SearchLength::log2_full:
      break;
  }
  return points * std::max<std::size_t>(ceil_log(points, 2), 1);
}

LocalSearch::LocalSearch(std::span<const Point3> points, std::span<const double> weights,
                         double facility_cost)
    : weights_(weights.begin(), weights.end()) {
  assert(!points.empty() && points.size() <= UINT32_MAX);
  assert(weights.empty() || weights.size() == points.size());
  assert(facility_cost > 0);
  const Scaling scaling(points);
  points_.reserve(points.size());
  for (const Point3& p : points) points_.push_back(scaling.scaled(p));
  if (weights_.empty()) weights_.assign(points.size(), 1.0);
  unit_exponent_ = scaling.exponent;
  facility_cost_ = facility_cost * scaling.diagonal;
  // One facility to begin with, so that the object is a solution at any time.
  facility_.assign(points.size(), 0);
  distance_.resize(points.size());
  closing_.assign(points.size(), 0.0);
  is_open_.assign(points.size(), false);
  is_open_[0] = true;
  facility_count_ = 1;
  for (std::uint32_t i = 0; i < points_.size(); ++i) distance_[i] = distance(i, 0);
}

double LocalSearch::distance(std::uint32_t a, std::uint32_t b) const {
  const double x = points_[a][0] - points_[b][0];
  const double y = points_[a][1] - points_[b][1];
  const double z = points_[a][2] - points_[b][2];
  return std::sqrt(x * x + y * y + z * z);
}

void LocalSearch::start(std::mt19937_64& random) {
  const auto count = static_cast<std::uint32_t>(points_.size());
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  for (std::uint32_t i = count; i > 1; --i) std::swap(order[i - 1], order[below(i, random)]);

  is_open_.assign(count, false);
  std::vector<std::uint32_t> open;
  for (const std::uint32_t i : order) {
    std::uint32_t nearest = i;
    double least = 0.0;
    for (std::size_t k = 0; k < open.size(); ++k) {
      const double d = distance(i, open[k]);
      if (k == 0 || d < least) {
        least = d;
        nearest = open[k];
      }
    }
    if (open.empty() || unit_double(random) * facility_cost_ < weights_[i] * least) {
      open.push_back(i);
      is_open_[i] = true;
      nearest = i;
      least = 0.0;
    }
    facility_[i] = nearest;
    distance_[i] = least;
  }
  facility_count_ = open.size();
}

double LocalSearch::judge(std::uint32_t candidate) {
  std::fill(closing_.begin(), closing_.end(), 0.0);
  double gain = is_open_[candidate] ? 0.0 : -facility_cost_;
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    const double spared = weights_[i] * (distance_[i] - distance(i, candidate));
    if (spared > 0) {
      gain += spared;
    } else {
      closing_[facility_[i]] -= spared;
    }
  }
  for (std::uint32_t j = 0; j < points_.size(); ++j) {
    if (is_open_[j] && j != candidate) gain += std::max(0.0, facility_cost_ - closing_[j]);
  }
  return gain;
}

double LocalSearch::gain(std::uint32_t candidate) {
  return std::ldexp(judge(candidate), unit_exponent_);
}

void LocalSearch::open(std::uint32_t candidate) {
  judge(candidate);
  if (!is_open_[candidate]) ++facility_count_;
  is_open_[candidate] = true;
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    const double d = distance(i, candidate);
    const std::uint32_t j = facility_[i];
    const bool closes = j != candidate && closing_[j] < facility_cost_;
    if (d < distance_[i] || closes) {
      distance_[i] = d;
      facility_[i] = candidate;
    }
  }
  for (std::uint32_t j = 0; j < points_.size(); ++j) {
    if (is_open_[j] && j != candidate && closing_[j] < facility_cost_) {
      is_open_[j] = false;
      --facility_count_;
    }
  }
  // A point at no distance from its old facility stays there; the candidate is its own client.
  facility_[candidate] = candidate;
  distance_[candidate] = 0.0;
}

void LocalSearch::improve(std::size_t candidates, std::mt19937_64& random) {
  for (std::size_t k = 0; k < candidates; ++k) {
    const std::uint32_t candidate = below(points_.size(), random);
    if (judge(candidate) > 0) open(candidate);
  }
}

double LocalSearch::cost() const {
  double cost = static_cast<double>(facility_count_) * facility_cost_;
  for (std::uint32_t i = 0; i < points_.size(); ++i) cost += weights_[i] * distance_[i];
  return std::ldexp(cost, unit_exponent_);
}

void LocalSearch::result(BlockClustering& clustering) const {
  clustering.facilities.clear();
  std::vector<std::uint32_t> number(points_.size());
  for (std::uint32_t j = 0; j < points_.size(); ++j) {
    if (!is_open_[j]) continue;
    number[j] = static_cast<std::uint32_t>(clustering.facilities.size());
    clustering.facilities.push_back(j);
  }
  clustering.assignment.resize(points_.size());
  double connections = 0.0;
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    clustering.assignment[i] = number[facility_[i]];
    connections += weights_[i] * distance_[i];
  }
  clustering.facility_cost = std::ldexp(facility_cost_, unit_exponent_);
  clustering.connection_cost = std::ldexp(connections, unit_exponent_);
}

void local_search(std::span<const Point3> points, std::span<const double> weights,
                  double facility_cost, SearchLength length, std::uint64_t seed,
                  BlockClustering& clustering) {
  if (points.empty()) {
    clustering = {};
    return;
  }
  std::mt19937_64 random(seed);
  LocalSearch search(points, weights, facility_cost);
  search.start(random);
  search.improve(candidate_count(length, points.size()), random);
  search.result(clustering);
}

}  // namespace terrace::cluster
