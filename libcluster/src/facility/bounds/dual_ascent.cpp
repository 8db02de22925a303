// SPDX-License-Identifier: Apache-2.0
#include "facility/bounds/dual_ascent.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace terrace::cluster {

DualAscent::DualAscent(const ClientOrder& order, const MatrixRows& costs)
    : order_(&order),
      costs_(&costs),
      duals_(order.clients()),
      slack_(costs.opening().begin(), costs.opening().end()),
      reach_(order.clients(), 0),
      all_(order.clients()),
      tight_(order.facilities(), 0),
      support_(order.facilities(), 0) {
  std::iota(all_.begin(), all_.end(), 0u);
  const auto m = static_cast<std::uint32_t>(order.facilities());
  for (std::uint32_t i = 0; i < duals_.size(); ++i) {
    duals_[i] = order.cost(i)[0];
    while (reach_[i] < m && order.cost(i)[reach_[i]] <= duals_[i]) ++reach_[i];
  }
}

bool DualAscent::raise_one(std::uint32_t client) {
  const auto m = static_cast<std::uint32_t>(order_->facilities());
  const double* const costs = order_->cost(client);
  const std::uint32_t* const facilities = order_->facility(client);
  std::uint32_t& reach = reach_[client];
  double room = reach < m ? costs[reach] - duals_[client] : std::numeric_limits<double>::infinity();
  const double to_next = room;
  for (std::uint32_t r = 0; r < reach && room > 0.0; ++r) {
    room = std::min(room, slack_[facilities[r]]);
  }
  if (!(room > 0.0)) return false;
  for (std::uint32_t r = 0; r < reach; ++r) slack_[facilities[r]] -= room;
  if (room == to_next) {
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
  std::uint32_t& reach = reach_[client];
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
      for (std::uint32_t r = 0; r < reach_[i] && !served; ++r) {
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
  for (std::uint32_t r = 0; r < reach_[client] && costs[r] < duals_[client]; ++r) {
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
      bool one_of_two = false;
      for (std::uint32_t r = 0; r < reach_[other] && count < 2; ++r) {
        if (!tight_[facilities[r]]) continue;
        ++count;
        one_of_two |= facilities[r] == two[0] || facilities[r] == two[1];
      }
      if (count == 1 && one_of_two && other != i) freed.push_back(other);
    }
    if (freed.empty()) continue;
    State kept{duals_, slack_, reach_};
    const double sum = total();
    lower_one(i);
    raise(freed);
    freed.push_back(i);
    raise(freed);
    raise(all_);
    if (total() < sum) {
      duals_.swap(kept.duals);
      slack_.swap(kept.slack);
      reach_.swap(kept.reach);
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

}  // namespace terrace::cluster
