// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include <terrace/base/parallel.hpp>
#include <terrace/base/random.hpp>

#include "facility/matrix/cost_rows.hpp"
#include "facility/matrix/matrix_search.hpp"
#include "facility/matrix/strategies.hpp"

namespace terrace::cluster {
namespace {

using Clock = std::chrono::steady_clock;

struct Length {
  std::uint32_t restarts;
  std::size_t perturbations;  // per restart
};

Length length_of(const FacilityOptions& options) {
  constexpr Length kByEffort[] = {{2, 50}, {8, 200}, {8, 1000}, {32, 1000}};
  const Length& length = kByEffort[static_cast<std::size_t>(options.effort)];
  return {options.restarts.value_or(length.restarts), options.steps.value_or(length.perturbations)};
}

struct Solution {
  double cost = 0.0;
  std::vector<std::uint32_t> open;
};

// Perturbed solutions that end up worse are discarded: the search continues from the best one.
Solution search(const MatrixRows& costs, const FacilityOptions& options, std::size_t perturbations,
                std::uint32_t run, Clock::time_point start) {
  std::mt19937_64 random(base::seed_of_run(options.seed, run));
  MatrixSearch work(costs, costs.opening());
  const std::uint32_t seed_facility = base::draw_below(costs.facilities(), random);
  work.reset(std::span(&seed_facility, 1));
  work.descend(random);
  MatrixSearch best = work;
  const auto most = static_cast<std::uint32_t>(std::min<std::size_t>(8, costs.facilities()));
  for (std::size_t p = 0; p < perturbations; ++p) {
    if (std::chrono::duration<double>(Clock::now() - start).count() > options.seconds) break;
    work.perturb(1 + base::draw_below(most, random), random);
    work.descend(random);
    if (work.cost() <= best.cost()) {
      best = work;
    } else {
      work = best;
    }
  }
  Solution solution{best.cost(), {}};
  const auto open = best.state().facilities();
  solution.open.assign(open.begin(), open.end());
  std::sort(solution.open.begin(), solution.open.end());
  return solution;
}

}  // namespace

FacilitySolution interchange(const FacilityMatrix& problem, const FacilityOptions& options) {
  const Length length = length_of(options);
  if (length.restarts == 0) {
    throw std::invalid_argument("restarts is 0: give at least 1");
  }
  if (std::isnan(options.seconds)) {
    throw std::invalid_argument("the time limit is NaN: give seconds, or infinity");
  }
  const auto start = Clock::now();
  const MatrixRows costs(problem, options.check_stop);
  std::vector<Solution> solutions(length.restarts);
  base::parallel_for(length.restarts, options.threads, [&](std::size_t run) {
    solutions[run] =
        search(costs, options, length.perturbations, static_cast<std::uint32_t>(run), start);
  });
  const auto best =
      std::min_element(solutions.begin(), solutions.end(),
                       [](const Solution& a, const Solution& b) { return a.cost < b.cost; });
  return solution_of(problem, best->open, options.check_stop);
}

}  // namespace terrace::cluster
