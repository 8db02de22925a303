// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>
#include <queue>

#include <terrace/base/stop_check.hpp>

#include "facility/bounds/matrix_dual.hpp"
#include "facility/matrix/client_order.hpp"
#include "facility/matrix/strategies.hpp"

namespace terrace::cluster {
namespace {

using Event = std::pair<double, std::uint32_t>;  // time and facility or client
using Events = std::priority_queue<Event, std::vector<Event>, std::greater<>>;

class Growth {
 public:
  Growth(const MatrixRows& costs, const ClientOrder& order)
      : costs_(&costs),
        order_(&order),
        reached_(order.clients(), 0),
        connected_(order.clients(), 0),
        duals_(order.clients(), 0.0),
        offers_(costs.facilities()),
        opened_(costs.facilities(), 0) {}

  void run() {
    for (std::uint32_t i = 0; i < duals_.size(); ++i) reaches_.push({order_->cost(i)[0], i});
    for (std::uint32_t j = 0; j < offers_.size(); ++j) {
      if (costs_->opening()[j] == 0.0) payments_.push({0.0, j});
    }
    for (std::size_t waiting = duals_.size(); waiting > 0;) {
      costs_->check_stop();
      // At equal times facilities open first, so that clients that reach them then are connected at
      // once.
      if (!payments_.empty() &&
          (reaches_.empty() || payments_.top().first <= reaches_.top().first)) {
        const auto [time, j] = payments_.top();
        payments_.pop();
        if (!opened_[j] && time == payment_time(j)) waiting -= open(j, time);
      } else {
        const auto [time, i] = reaches_.top();
        reaches_.pop();
        if (!connected_[i]) waiting -= reach(i, time);
      }
    }
  }

  // Returns, in the order of opening, the facilities that share no payer with one that stays open.
  [[nodiscard]] std::vector<std::uint32_t> independent() const {
    std::vector<char> used(duals_.size(), 0);  // by client: has paid for a facility that stays
    std::vector<std::uint32_t> stay;
    for (const std::uint32_t j : opening_order_) {
      costs_->check_stop();
      bool free = true;
      for (std::size_t i = 0; i < duals_.size() && free; ++i) {
        free = !(used[i] && duals_[i] > costs_->cost(j, i));
      }
      if (!free) continue;
      stay.push_back(j);
      for (std::size_t i = 0; i < duals_.size(); ++i) {
        if (duals_[i] > costs_->cost(j, i)) used[i] = 1;
      }
    }
    std::sort(stay.begin(), stay.end());
    return stay;
  }

  [[nodiscard]] const std::vector<double>& duals() const { return duals_; }

 private:
  struct Offers {
    double fixed = 0.0;         // offers of connected clients
    double costs = 0.0;         // sum of connection costs of the clients whose offers grow
    std::uint32_t growing = 0;  // number of these clients
  };

  // Returns the time at which the offers, growing at the current rate, reach the opening cost.
  [[nodiscard]] double payment_time(std::uint32_t j) const {
    const Offers& o = offers_[j];
    if (costs_->opening()[j] == 0.0) return 0.0;
    return (costs_->opening()[j] - o.fixed + o.costs) / o.growing;
  }

  void announce(std::uint32_t j) {
    if (!opened_[j] && offers_[j].growing > 0) payments_.push({payment_time(j), j});
  }

  std::size_t reach(std::uint32_t i, double time) {
    const std::uint32_t r = reached_[i]++;
    const std::uint32_t j = order_->facility(i)[r];
    if (opened_[j]) {
      connect(i, time);
      return 1;
    }
    Offers& o = offers_[j];
    ++o.growing;
    o.costs += order_->cost(i)[r];
    announce(j);
    if (reached_[i] < order_->facilities()) reaches_.push({order_->cost(i)[reached_[i]], i});
    return 0;
  }

  std::size_t open(std::uint32_t j, double time) {
    opened_[j] = 1;
    opening_order_.push_back(j);
    std::size_t count = 0;
    for (std::uint32_t i = 0; i < duals_.size(); ++i) {
      // Uses the same test that counted the offer, so that a rounded time misses no client.
      if (connected_[i] || !has_reached(i, j)) continue;
      connect(i, time);
      ++count;
    }
    return count;
  }

  [[nodiscard]] bool has_reached(std::uint32_t i, std::uint32_t j) const {
    const double c = costs_->cost(j, i);
    const std::uint32_t next = reached_[i];
    if (next == order_->facilities()) return true;
    const double next_cost = order_->cost(i)[next];
    return c < next_cost || (c == next_cost && j < order_->facility(i)[next]);
  }

  void connect(std::uint32_t i, double time) {
    connected_[i] = 1;
    duals_[i] = std::max(time, order_->cost(i)[reached_[i] == 0 ? 0 : reached_[i] - 1]);
    for (std::uint32_t r = 0; r < reached_[i]; ++r) {
      const std::uint32_t j = order_->facility(i)[r];
      Offers& o = offers_[j];
      if (opened_[j]) continue;
      --o.growing;
      o.costs -= order_->cost(i)[r];
      if (o.growing == 0) o.costs = 0.0;
      o.fixed += duals_[i] - order_->cost(i)[r];
      announce(j);
    }
  }

  const MatrixRows* costs_;
  const ClientOrder* order_;
  std::vector<std::uint32_t> reached_;  // per client: number of facilities its offer has reached
  std::vector<char> connected_;
  std::vector<double> duals_;
  std::vector<Offers> offers_;
  std::vector<char> opened_;
  std::vector<std::uint32_t> opening_order_;
  Events reaches_, payments_;
};

}  // namespace

FacilitySolution jain_vazirani(const FacilityMatrix& problem, FacilityReport& report,
                               const base::StopCheck& check_stop) {
  const MatrixRows costs(problem, check_stop);
  const ClientOrder order(costs);
  Growth growth(costs, order);
  growth.run();
  FacilitySolution solution = solution_of(problem, growth.independent(), check_stop);
  report.duals = growth.duals();
  for (double& v : report.duals) v = costs.unscaled(v);
  solution.lower_bound = dual_value(problem, report.duals, check_stop);
  return solution;
}

}  // namespace terrace::cluster
