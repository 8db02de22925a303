// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include "facility/box_tree.hpp"
#include "facility/matrix_dual.hpp"
#include "facility/point_dual.hpp"
#include "facility/point_space.hpp"
#include "terrace/cluster/lower_bound.hpp"

namespace terrace::cluster {
namespace {

void check_start(const FacilityPoints& problem, const FacilitySolution& start) {
  const std::size_t n = problem.points.size();
  if (start.assignment.size() != n) {
    throw std::invalid_argument("the solution assigns " + std::to_string(start.assignment.size()) +
                                " of " + std::to_string(n) + " points");
  }
  for (const std::uint32_t j : start.facilities) {
    if (j < n) continue;
    throw std::invalid_argument("the solution has facility " + std::to_string(j) + " of " +
                                std::to_string(n) + " points");
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t c = start.assignment[i];
    if (c < start.facilities.size()) continue;
    if (c == kOutlier && problem.outlier_price < std::numeric_limits<double>::infinity()) continue;
    throw std::invalid_argument("the solution leaves point " + std::to_string(i) +
                                " without a facility");
  }
}

// The start in an order of its own, its distances, and what follows from them.
struct Start {
  std::vector<std::uint32_t> facility;  // per client
  std::vector<double> distance;         // at most the price
  double cost = 0.0;

  template <class Space>
  Start(const Space& space, const FacilitySolution& start, const std::vector<std::uint32_t>& order,
        const SearchFrame& frame)
      : facility(order.size(), kOutlier), distance(order.size(), frame.outlier_price) {
    std::vector<std::uint32_t> place(order.size());
    for (std::uint32_t k = 0; k < order.size(); ++k) place[order[k]] = k;
    for (std::uint32_t k = 0; k < order.size(); ++k) {
      const std::uint32_t c = start.assignment[order[k]];
      if (c == kOutlier) continue;
      facility[k] = place[start.facilities[c]];
      distance[k] = std::min(distance[k], space.from(facility[k])(k));
    }
    cost = frame.facility_cost * static_cast<double>(start.facilities.size());
    for (std::size_t k = 0; k < order.size(); ++k) cost += frame.weights[k] * distance[k];
  }

  // Payments per weight: in each cluster the same level, where that is above the distance, so high
  // that the cluster pays for its facility.
  [[nodiscard]] std::vector<double> payments(const SearchFrame& frame) const {
    const std::size_t n = facility.size();
    std::vector<std::uint32_t> clients(n);
    std::iota(clients.begin(), clients.end(), 0u);
    std::sort(clients.begin(), clients.end(), [&](std::uint32_t a, std::uint32_t b) {
      if (facility[a] != facility[b]) return facility[a] < facility[b];
      return distance[a] < distance[b] || (distance[a] == distance[b] && a < b);
    });
    std::vector<double> result = distance;
    for (std::size_t begin = 0, end = 0; begin < n; begin = end) {
      double weight = 0.0, sum = frame.facility_cost, level = 0.0;
      for (; end < n && facility[clients[end]] == facility[clients[begin]]; ++end) {
        const std::uint32_t i = clients[end];
        if (weight > 0.0 && distance[i] >= level) continue;
        weight += frame.weights[i];
        sum += frame.weights[i] * distance[i];
        if (weight > 0.0) level = sum / weight;
      }
      for (std::size_t k = begin; k < end; ++k) {
        double& payment = result[clients[k]];
        payment = std::min(std::max(payment, level), frame.outlier_price);
      }
    }
    return result;
  }
};

void permute(SearchFrame& frame, const std::vector<std::uint32_t>& order) {
  const SearchFrame old = frame;
  const std::size_t channels = frame.channel_count;
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (!old.points.empty()) frame.points[k] = old.points[order[k]];
    frame.weights[k] = old.weights[order[k]];
    for (std::size_t c = 0; c < channels; ++c) {
      frame.channels[k * channels + c] = old.channels[order[k] * channels + c];
    }
  }
}

}  // namespace

DualBound lower_bound(const FacilityPoints& problem, const FacilitySolution& start,
                      const LowerBoundOptions& options) {
  check(problem);
  check_start(problem, start);
  SearchFrame frame = make_frame(problem);
  std::vector<std::uint32_t> order(problem.points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<Point3> original(problem.points.begin(), problem.points.end());
  std::optional<BoxTree> tree;
  if (!frame.points.empty()) {
    tree.emplace(BoxTree::Kind::kd_tree, frame.points);
    order = tree->order();
    permute(frame, order);
    for (std::size_t k = 0; k < order.size(); ++k) original[k] = problem.points[order[k]];
  }
  const double rounding = rounding_of_frame(problem, frame);
  DualBound bound;
  std::vector<double> duals;
  const double value = with_space(problem, frame, original, [&](const auto& space) {
    using Space = std::decay_t<decltype(space)>;
    const Start first(space, start, order, frame);
    duals = first.payments(frame);
    if constexpr (Space::kHasBoxes) {
      PointDual<Space> function(*tree, space, frame.weights, frame.facility_cost,
                                frame.outlier_price, options.threads);
      std::vector<double> variables = function.variables(duals);
      const double best = ascend(function, variables, first.cost, options);
      duals = function.duals(variables);
      return best;
    } else {
      const PointRows<Space> rows(space, frame.weights, frame.outlier_price);
      const std::vector<double> opening(order.size(), frame.facility_cost);
      std::vector<double> ceiling;
      if (std::isfinite(frame.outlier_price)) {
        for (const double w : frame.weights) ceiling.push_back(w * frame.outlier_price);
      }
      for (std::size_t i = 0; i < duals.size(); ++i) duals[i] *= frame.weights[i];
      RowDual function(rows, opening, ceiling, options.threads);
      return ascend(function, duals, first.cost, options);
    }
  });
  bound.lower_bound = std::ldexp(std::max(0.0, value - rounding), frame.cost_exponent);
  bound.duals.resize(duals.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    bound.duals[order[k]] = std::ldexp(duals[k], frame.cost_exponent);
  }
  return bound;
}

}  // namespace terrace::cluster
