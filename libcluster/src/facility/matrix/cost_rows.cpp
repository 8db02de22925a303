// SPDX-License-Identifier: Apache-2.0
#include "facility/matrix/cost_rows.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include <terrace/base/stop_check.hpp>

namespace terrace::cluster {

MatrixRows::MatrixRows(const FacilityMatrix& matrix, const base::StopCheck& check_stop)
    : CostRows(matrix.facilities, matrix.clients, check_stop),
      opening_(matrix.opening),
      connection_(matrix.connection) {
  double largest = 0.0;
  for (const double c : opening_) largest = std::max(largest, c);
  base::StopTicks ticks(check_stop);
  for (const double c : connection_) {
    ticks();
    largest = std::max(largest, c);
  }
  if (largest == 0.0) return;
  const int top = std::ilogb(largest);
  if (top >= 900) exponent_ = top - 899;
  if (top < -900) exponent_ = top;
  if (exponent_ == 0) return;
  owned_.reserve(opening_.size() + connection_.size());
  for (const double c : opening_) owned_.push_back(scaled(c));
  for (const double c : connection_) {
    ticks(4);
    owned_.push_back(scaled(c));
  }
  opening_ = std::span(owned_).first(opening_.size());
  connection_ = std::span(owned_).subspan(opening_.size());
}

const double* MatrixRows::row(std::size_t facility, std::vector<double>& /*scratch*/) const {
  check_stop();
  return connection_.data() + facility * clients();
}

void MatrixRows::gather(std::size_t facility, std::span<const std::uint32_t> indices,
                        double* out) const {
  check_stop();
  const double* const costs = connection_.data() + facility * clients();
  for (std::size_t k = 0; k < indices.size(); ++k) out[k] = costs[indices[k]];
}

double MatrixRows::unscaled(double cost) const {
  return exponent_ == 0 ? cost : std::ldexp(cost, exponent_);
}

double MatrixRows::scaled(double cost) const {
  return exponent_ == 0 ? cost : std::ldexp(cost, -exponent_);
}

FacilitySolution solution_of(const FacilityMatrix& matrix, std::span<const std::uint32_t> open,
                             const base::StopCheck& check_stop) {
  assert(!open.empty());
  FacilitySolution solution;
  std::vector<double> least(matrix.clients, std::numeric_limits<double>::infinity());
  solution.assignment.assign(matrix.clients, 0);
  base::StopTicks ticks(check_stop);
  for (std::size_t k = 0; k < open.size(); ++k) {
    ticks(matrix.clients);
    const double* const costs = matrix.connection.data() + open[k] * matrix.clients;
    for (std::size_t i = 0; i < matrix.clients; ++i) {
      if (costs[i] < least[i]) {
        least[i] = costs[i];
        solution.assignment[i] = static_cast<std::uint32_t>(k);
      }
    }
  }
  std::vector<std::uint32_t> number(open.size(), kOutlier);
  for (const std::uint32_t k : solution.assignment) number[k] = 0;
  for (std::size_t k = 0; k < open.size(); ++k) {
    if (number[k] == kOutlier) continue;
    number[k] = static_cast<std::uint32_t>(solution.facilities.size());
    solution.facilities.push_back(open[k]);
    solution.opening_cost += matrix.opening[open[k]];
  }
  for (std::size_t i = 0; i < matrix.clients; ++i) {
    solution.assignment[i] = number[solution.assignment[i]];
    solution.connection_cost += least[i];
  }
  return solution;
}

}  // namespace terrace::cluster
