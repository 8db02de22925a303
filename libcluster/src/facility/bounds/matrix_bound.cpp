// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "facility/bounds/matrix_dual.hpp"
#include "facility/matrix/client_order.hpp"
#include "facility/matrix/strategies.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

/// Erlenkotter's procedure, which improves feasible duals.
class DualAscent {
 public:
  /// Starts from the least cost of each client. Takes O(facilities * clients).
  DualAscent(const ClientOrder& order, const MatrixRows& costs);

  /// Raises the duals of these clients in turn until none can be raised. Like adjust(), throws
  /// whatever the stop check of the costs throws.
  void raise(std::span<const std::uint32_t> clients);
  /// Makes one round of dual adjustment. Returns whether the sum of the duals has grown.
  bool adjust();

  [[nodiscard]] const std::vector<double>& duals() const { return duals_; }
  [[nodiscard]] double total() const;

 private:
  struct State {
    std::vector<double> duals, slack;
    std::vector<std::uint32_t> reach;
  };

  bool raise_one(std::uint32_t client);
  void lower_one(std::uint32_t client);
  void find_support();
  [[nodiscard]] std::uint32_t payments(std::uint32_t client, std::uint32_t (&two)[2]) const;

  const ClientOrder* order_;
  const MatrixRows* costs_;
  std::vector<double> duals_;
  std::vector<double> slack_;  // opening cost minus payments, by facility
  std::vector<std::uint32_t>
      reached_;  // per client: number of facilities that cost at most its dual
  std::vector<std::uint32_t> all_;
  std::vector<char> tight_;    // by facility: its slack is used up
  std::vector<char> support_;  // by facility: in a small tight set that reaches every client
};

DualAscent::DualAscent(const ClientOrder& order, const MatrixRows& costs)
    : order_(&order),
      costs_(&costs),
      duals_(order.clients()),
      slack_(costs.opening().begin(), costs.opening().end()),
      reached_(order.clients(), 0),
      all_(order.clients()),
      tight_(order.facilities(), 0),
      support_(order.facilities(), 0) {
  std::iota(all_.begin(), all_.end(), 0u);
  const auto m = static_cast<std::uint32_t>(order.facilities());
  for (std::uint32_t i = 0; i < duals_.size(); ++i) {
    duals_[i] = order.cost(i)[0];
    while (reached_[i] < m && order.cost(i)[reached_[i]] <= duals_[i]) ++reached_[i];
  }
}

bool DualAscent::raise_one(std::uint32_t client) {
  const auto m = static_cast<std::uint32_t>(order_->facilities());
  const double* const costs = order_->cost(client);
  const std::uint32_t* const facilities = order_->facility(client);
  std::uint32_t& reach = reached_[client];
  double room = reach < m ? costs[reach] - duals_[client] : std::numeric_limits<double>::infinity();
  const double next_step = room;
  for (std::uint32_t r = 0; r < reach && room > 0.0; ++r) {
    room = std::min(room, slack_[facilities[r]]);
  }
  if (!(room > 0.0)) return false;
  for (std::uint32_t r = 0; r < reach; ++r) slack_[facilities[r]] -= room;
  if (room == next_step) {
    duals_[client] = costs[reach];
    while (reach < m && costs[reach] <= duals_[client]) ++reach;
    return true;
  }
  const double before = duals_[client];
  duals_[client] += room;
  return duals_[client] > before;
}

void DualAscent::lower_one(std::uint32_t client) {
  const double* const costs = order_->cost(client);
  const std::uint32_t* const facilities = order_->facility(client);
  std::uint32_t& reach = reached_[client];
  // Facilities that cost exactly the dual are not paid, so they drop out of reach.
  std::uint32_t paid = reach;
  while (paid > 0 && costs[paid - 1] >= duals_[client]) --paid;
  const double target = costs[paid - 1];
  const double back = duals_[client] - target;
  for (std::uint32_t r = 0; r < paid; ++r) slack_[facilities[r]] += back;
  duals_[client] = target;
  reach = paid;
}

void DualAscent::raise(std::span<const std::uint32_t> clients) {
  for (bool raised = true; raised;) {
    raised = false;
    for (const std::uint32_t i : clients) {
      costs_->check_stop();
      raised |= raise_one(i);
    }
  }
}

void DualAscent::find_support() {
  for (std::size_t j = 0; j < slack_.size(); ++j) tight_[j] = slack_[j] <= 0.0;
  std::fill(support_.begin(), support_.end(), char{0});
  // First takes facilities that are the only tight one within reach of some client, then the
  // cheapest for the remaining clients.
  for (const bool essential : {true, false}) {
    for (std::uint32_t i = 0; i < duals_.size(); ++i) {
      const std::uint32_t* const facilities = order_->facility(i);
      std::uint32_t count = 0, cheapest = 0;
      bool served = false;
      for (std::uint32_t r = 0; r < reached_[i] && !served; ++r) {
        const std::uint32_t j = facilities[r];
        served = support_[j] != 0;
        if (tight_[j] && count++ == 0) cheapest = j;
      }
      if (!served && count > 0 && (!essential || count == 1)) support_[cheapest] = 1;
    }
  }
}

std::uint32_t DualAscent::payments(std::uint32_t client, std::uint32_t (&two)[2]) const {
  const double* const costs = order_->cost(client);
  const std::uint32_t* const facilities = order_->facility(client);
  std::uint32_t count = 0;
  for (std::uint32_t r = 0; r < reached_[client] && costs[r] < duals_[client]; ++r) {
    if (!support_[facilities[r]]) continue;
    if (count < 2) two[count] = facilities[r];
    ++count;
  }
  return count;
}

bool DualAscent::adjust() {
  const double before = total();
  find_support();
  std::vector<std::uint32_t> freed;
  for (std::uint32_t i = 0; i < duals_.size(); ++i) {
    costs_->check_stop();
    std::uint32_t two[2];
    if (payments(i, two) < 2) continue;
    // Clients for which one of the two is the only tight facility within reach can rise instead.
    freed.clear();
    for (std::uint32_t other = 0; other < duals_.size(); ++other) {
      const std::uint32_t* const facilities = order_->facility(other);
      std::uint32_t count = 0;
      bool shares_facility = false;
      for (std::uint32_t r = 0; r < reached_[other] && count < 2; ++r) {
        if (!tight_[facilities[r]]) continue;
        ++count;
        shares_facility |= facilities[r] == two[0] || facilities[r] == two[1];
      }
      if (count == 1 && shares_facility && other != i) freed.push_back(other);
    }
    if (freed.empty()) continue;
    State backup{duals_, slack_, reached_};
    const double sum = total();
    lower_one(i);
    raise(freed);
    freed.push_back(i);
    raise(freed);
    raise(all_);
    if (total() < sum) {
      duals_.swap(backup.duals);
      slack_.swap(backup.slack);
      reached_.swap(backup.reach);
    } else {
      find_support();
    }
  }
  return total() > before * (1.0 + 1e-12);
}

double DualAscent::total() const {
  double sum = 0.0;
  for (const double v : duals_) sum += v;
  return sum;
}

/// Returns the value at scaled duals, in the unit of the problem, rounded down.
double safe_value(const MatrixRows& costs, const std::vector<double>& duals) {
  RowDual function(costs, costs.opening(), {}, 1);
  std::vector<double> slope(duals.size());
  return costs.unscaled(std::max(0.0, function.evaluate(duals, slope).safe()));
}

void unscale(const MatrixRows& costs, std::vector<double>& duals) {
  for (double& v : duals) v = costs.unscaled(v);
}

/// Returns scaled feasible duals: those of DualAscent after at most 20 rounds of adjustment.
std::vector<double> ascend_duals(const MatrixRows& costs) {
  constexpr int kAdjustments = 20;
  const ClientOrder order(costs);
  DualAscent ascent(order, costs);
  std::vector<std::uint32_t> all(costs.clients());
  std::iota(all.begin(), all.end(), 0u);
  ascent.raise(all);
  for (int k = 0; k < kAdjustments; ++k) {
    if (!ascent.adjust()) break;
  }
  return ascent.duals();
}

}  // namespace

double dual_value(const FacilityMatrix& problem, std::span<const double> duals,
                  const base::StopCheck& check_stop) {
  check(problem, check_stop);
  if (duals.size() != problem.clients) {
    throw std::invalid_argument(std::to_string(duals.size()) + " duals for " +
                                std::to_string(problem.clients) + " clients");
  }
  for (std::size_t i = 0; i < duals.size(); ++i) {
    if (std::isfinite(duals[i])) continue;
    throw std::invalid_argument("the dual of client " + std::to_string(i) + " is not finite");
  }
  const MatrixRows costs(problem, check_stop);
  std::vector<double> scaled(duals.begin(), duals.end());
  for (double& v : scaled) v = costs.scaled(v);
  return safe_value(costs, scaled);
}

LowerBound lower_bound(const FacilityMatrix& problem, const FacilitySolution& start,
                       const LowerBoundOptions& options) {
  check(problem, options.check_stop);
  const MatrixRows costs(problem, options.check_stop);
  LowerBound bound;
  bound.duals = ascend_duals(costs);
  if (options.steps > 0) {
    FacilityReport report;
    const FacilitySolution target =
        start.facilities.empty() ? greedy_stars(problem, report, options.check_stop) : start;
    double cost = 0.0;  // scaled, because the sum of large costs may be infinite
    for (const std::uint32_t j : target.facilities) {
      if (j >= problem.facilities) {
        throw std::invalid_argument("the solution has facility " + std::to_string(j) +
                                    ", but there are only " + std::to_string(problem.facilities));
      }
      cost += costs.opening()[j];
    }
    if (target.assignment.size() != problem.clients) {
      throw std::invalid_argument("the solution assigns " +
                                  std::to_string(target.assignment.size()) +
                                  " clients, but there are " + std::to_string(problem.clients));
    }
    for (std::size_t i = 0; i < problem.clients; ++i) {
      const std::uint32_t c = target.assignment[i];
      if (c >= target.facilities.size()) {
        throw std::invalid_argument("the solution leaves client " + std::to_string(i) +
                                    " without a facility");
      }
      cost += costs.cost(target.facilities[c], i);
    }
    RowDual function(costs, costs.opening(), {}, options.threads);
    function.clamp(bound.duals);
    ascend(function, bound.duals, cost, options);
  }
  bound.lower_bound = safe_value(costs, bound.duals);
  unscale(costs, bound.duals);
  return bound;
}

}  // namespace terrace::cluster
