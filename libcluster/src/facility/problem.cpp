// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <stdexcept>
#include <string>

#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

[[noreturn]] void fail(const std::string& what) { throw std::invalid_argument(what); }

bool is_cost(double value) { return value >= 0.0 && std::isfinite(value); }

void check_count(std::size_t count, const char* what) {
  constexpr std::size_t kMost = 0xfffffffe;
  if (count == 0) fail(std::string("facility location needs ") + what);
  if (count > kMost) {
    fail(std::to_string(count) + " " + what + ": at most " + std::to_string(kMost) +
         " are possible; cluster them in blocks (hierarchy.hpp)");
  }
}

void check_weights(std::span<const double> weights, std::size_t count, const std::string& one,
                   const std::string& many) {
  if (!weights.empty() && weights.size() != count) {
    fail(std::to_string(weights.size()) + " weights for " + std::to_string(count) + " " + many);
  }
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] > 0.0 && std::isfinite(weights[i])) continue;
    fail("the weight of " + one + " " + std::to_string(i) + " is " + std::to_string(weights[i]) +
         ": weights must be positive and finite");
  }
}

}  // namespace

void check(const FacilityMatrix& problem, const base::StopCheck& check_stop) {
  check_count(problem.facilities, "facilities");
  check_count(problem.clients, "clients");
  if (problem.opening.size() != problem.facilities) {
    fail(std::to_string(problem.opening.size()) + " opening costs for " +
         std::to_string(problem.facilities) + " facilities");
  }
  if (problem.connection.size() / problem.facilities != problem.clients ||
      problem.connection.size() % problem.facilities != 0) {
    fail(std::to_string(problem.connection.size()) + " connection costs for " +
         std::to_string(problem.facilities) + " facilities times " +
         std::to_string(problem.clients) + " clients");
  }
  for (std::size_t j = 0; j < problem.facilities; ++j) {
    if (is_cost(problem.opening[j])) continue;
    fail("the opening cost of facility " + std::to_string(j) + " is " +
         std::to_string(problem.opening[j]) + ": costs must be finite and not negative");
  }
  base::StopTicks ticks(check_stop);
  for (std::size_t j = 0; j < problem.facilities; ++j) {
    ticks(problem.clients);
    for (std::size_t i = 0; i < problem.clients; ++i) {
      if (is_cost(problem.cost(j, i))) continue;
      fail("the cost of connecting client " + std::to_string(i) + " to facility " +
           std::to_string(j) + " is " + std::to_string(problem.cost(j, i)) +
           ": costs must be finite and not negative; for an impossible connection give a "
           "cost above every other");
    }
  }
}

void check(const FacilityPoints& problem) {
  const std::size_t count = problem.points.size();
  check_count(count, "points");
  check(problem.metric);
  for (std::size_t i = 0; i < count; ++i) {
    for (const double value : problem.points[i]) {
      if (!std::isfinite(value)) {
        fail("point " + std::to_string(i) + " has a coordinate that is not finite: leave it out");
      }
    }
  }
  check_weights(problem.weights, count, "point", "points");
  const std::size_t channels = problem.channels.size();
  for (std::size_t c = 0; c < channels; ++c) {
    if (is_cost(problem.channels.weights[c])) continue;
    fail("the weight of channel " + std::to_string(c) + " is " +
         std::to_string(problem.channels.weights[c]) + ": it must be finite and not negative");
  }
  if (problem.channels.values.size() != count * channels) {
    fail(std::to_string(problem.channels.values.size()) + " channel values for " +
         std::to_string(count) + " points with " + std::to_string(channels) + " channels");
  }
  for (std::size_t k = 0; k < problem.channels.values.size(); ++k) {
    if (std::isfinite(problem.channels.values[k])) continue;
    fail("channel " + std::to_string(k % channels) + " of point " + std::to_string(k / channels) +
         " is not finite: leave the point out or give it a value");
  }
  if (!(problem.facility_cost > 0.0) || !std::isfinite(problem.facility_cost)) {
    fail("the facility cost is " + std::to_string(problem.facility_cost) +
         " diagonals: it must be positive and finite");
  }
  if (!(problem.outlier_price > 0.0)) {
    fail("the price of an outlier is " + std::to_string(problem.outlier_price) +
         " diagonals: it must be positive (infinite: no outliers)");
  }
}

void check(const FacilityEntities& problem) {
  check_count(problem.count, "entities");
  if (!problem.distance) fail("the entities have no distance function");
  check_weights(problem.weights, problem.count, "entity", "entities");
  if (!(problem.facility_cost > 0.0) || !std::isfinite(problem.facility_cost)) {
    fail("the facility cost is " + std::to_string(problem.facility_cost) +
         ": it must be positive and finite, in the unit of the distances");
  }
  if (!(problem.outlier_price > 0.0)) {
    fail("the price of an outlier is " + std::to_string(problem.outlier_price) +
         ": it must be positive, in the unit of the distances (infinite: no outliers)");
  }
}

}  // namespace terrace::cluster
