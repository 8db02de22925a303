// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <new>
#include <numeric>
#include <queue>
#include <stdexcept>
#include <string>
#include <utility>

#include <terrace/base/stop_check.hpp>

#include "facility/bounds/matrix_dual.hpp"
#include "facility/matrix/cost_rows.hpp"
#include "facility/matrix/strategies.hpp"

namespace terrace::cluster {
namespace {

// The growth of offers is equivalent to repeatedly taking the star (a facility and some clients)
// with the least cost per client, where an open facility costs nothing more. A star does not get
// cheaper as clients leave, except when its facility opens, so a queue of outdated values suffices.
class Stars {
 public:
  explicit Stars(const MatrixRows& costs)
      : costs_(&costs),
        opening_(costs.opening().begin(), costs.opening().end()),
        waiting_count_(costs.facilities(), static_cast<std::uint32_t>(costs.clients())),
        connected_(costs.clients(), 0),
        duals_(costs.clients(), 0.0) {
    const std::size_t m = costs.facilities(), n = costs.clients();
    try {
      order_.reserve(m * n);
    } catch (const std::bad_alloc&) {
      throw std::invalid_argument("clients sorted by facility would need " +
                                  std::to_string(4 * m * n) +
                                  " bytes, more than available: cluster the points instead "
                                  "(FacilityPoints), or in blocks");
    }
    std::vector<double> scratch;
    for (std::size_t j = 0; j < m; ++j) {
      const double* const row = costs.row(j, scratch);
      order_.resize((j + 1) * n);
      std::uint32_t* const order = row_order(static_cast<std::uint32_t>(j));
      std::iota(order, order + n, 0u);
      std::sort(order, order + n, [row](std::uint32_t a, std::uint32_t b) {
        return row[a] < row[b] || (row[a] == row[b] && a < b);
      });
    }
  }

  void run() {
    for (std::uint32_t j = 0; j < opening_.size(); ++j) push(j);
    double time = 0.0;
    for (std::size_t waiting = connected_.size(); waiting > 0;) {
      const auto [price, j] = queue_.top();
      queue_.pop();
      if (waiting_count_[j] == 0) continue;
      const Star star = cheapest(j);
      if (star.price > price) {
        if (star.clients > 0) queue_.push({star.price, j});
        continue;
      }
      if (opening_[j] > 0.0 || !is_open(j)) open_.push_back(j);
      opening_[j] = 0.0;
      // Prices do not decrease from star to star, except by rounding.
      time = std::max(time, star.price);
      const std::uint32_t* const order = row_order(j);
      for (std::uint32_t k = 0; k < star.clients; ++k) {
        connected_[order[k]] = 1;
        duals_[order[k]] = time;
      }
      waiting -= star.clients;
      push(j);
    }
    std::sort(open_.begin(), open_.end());
  }

  [[nodiscard]] const std::vector<std::uint32_t>& open() const { return open_; }
  [[nodiscard]] std::vector<double>& duals() { return duals_; }

 private:
  struct Star {
    double price = std::numeric_limits<double>::infinity();
    std::uint32_t clients = 0;
  };
  using Entry = std::pair<double, std::uint32_t>;

  std::uint32_t* row_order(std::uint32_t j) { return order_.data() + j * connected_.size(); }
  [[nodiscard]] bool is_open(std::uint32_t j) const {
    return std::find(open_.begin(), open_.end(), j) != open_.end();
  }

  // Finds the cheapest star over the waiting clients, nearest first, and drops the others from the
  // list.
  Star cheapest(std::uint32_t j) {
    costs_->check_stop();
    std::uint32_t* const order = row_order(j);
    std::uint32_t waiting = 0;
    for (std::uint32_t k = 0; k < waiting_count_[j]; ++k) {
      if (!connected_[order[k]]) order[waiting++] = order[k];
    }
    waiting_count_[j] = waiting;
    Star star;
    double sum = opening_[j];
    for (std::uint32_t k = 0; k < waiting; ++k) {
      const double cost = costs_->cost(j, order[k]);
      if (cost > star.price) break;  // the mean can only grow from here on
      sum += cost;
      const double price = sum / (k + 1.0);
      if (price <= star.price) star = {price, k + 1};
    }
    return star;
  }

  void push(std::uint32_t j) {
    const Star star = cheapest(j);
    if (star.clients > 0) queue_.push({star.price, j});
  }

  const MatrixRows* costs_;
  std::vector<double> opening_;
  std::vector<std::uint32_t> order_;          // per facility: waiting clients, nearest first
  std::vector<std::uint32_t> waiting_count_;  // per facility: number of waiting clients
  std::vector<char> connected_;
  std::vector<double> duals_;
  std::vector<std::uint32_t> open_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
};

bool is_feasible(const MatrixRows& costs, const std::vector<double>& duals, double divisor) {
  std::vector<double> scratch;
  for (std::size_t j = 0; j < costs.facilities(); ++j) {
    const double* const row = costs.row(j, scratch);
    double paid = 0.0;
    for (std::size_t i = 0; i < duals.size(); ++i) {
      paid += std::max(0.0, duals[i] / divisor - row[i]);
    }
    if (paid > costs.opening()[j] * (1.0 + 1e-12)) return false;
  }
  return true;
}

// Bisects between 1 and the harmonic number, at which the duals are feasible for any costs.
double least_divisor(const MatrixRows& costs, const std::vector<double>& duals) {
  if (is_feasible(costs, duals, 1.0)) return 1.0;
  double low = 1.0, high = 0.0;
  for (std::size_t i = 1; i <= duals.size(); ++i) high += 1.0 / static_cast<double>(i);
  while (high - low > 1e-9) {
    const double middle = 0.5 * (low + high);
    (is_feasible(costs, duals, middle) ? high : low) = middle;
  }
  return high;
}

}  // namespace

FacilitySolution greedy_stars(const FacilityMatrix& problem, FacilityReport& report,
                              const base::StopCheck& check_stop) {
  const MatrixRows costs(problem, check_stop);
  Stars stars(costs);
  stars.run();
  FacilitySolution solution = solution_of(problem, stars.open(), check_stop);
  report.divisor = least_divisor(costs, stars.duals());
  report.duals = std::move(stars.duals());
  std::vector<double> feasible = report.duals;
  for (double& v : report.duals) v = costs.unscaled(v);
  for (double& v : feasible) v = costs.unscaled(v / report.divisor);
  solution.lower_bound = dual_value(problem, feasible, check_stop);
  return solution;
}

}  // namespace terrace::cluster
