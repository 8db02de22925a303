// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/facility_search.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "draws.hpp"
#include "facility/cost_rows.hpp"
#include "facility/matrix_search.hpp"
#include "parallel.hpp"

namespace terrace::cluster {
namespace {

using Clock = std::chrono::steady_clock;

struct Found {
  double cost = 0.0;
  std::vector<std::uint32_t> open;
};

// Disturbed solutions that end up worse are given up: the search goes on from the best.
Found search(const MatrixRows& costs, const FacilitySearchOptions& options, std::uint32_t run,
             Clock::time_point start) {
  std::mt19937_64 random(seed_of_run(options.seed, run));
  MatrixSearch work(costs, costs.opening());
  const std::uint32_t seed_facility = draw_below(costs.facilities(), random);
  work.reset(std::span(&seed_facility, 1));
  work.descend(random);
  MatrixSearch best = work;
  const auto most = static_cast<std::uint32_t>(std::min<std::size_t>(8, costs.facilities()));
  for (std::uint32_t p = 0; p < options.perturbations; ++p) {
    if (std::chrono::duration<double>(Clock::now() - start).count() > options.seconds) break;
    work.perturb(1 + draw_below(most, random), random);
    work.descend(random);
    if (work.cost() <= best.cost()) {
      best = work;
    } else {
      work = best;
    }
  }
  Found found{best.cost(), {}};
  const auto open = best.state().facilities();
  found.open.assign(open.begin(), open.end());
  std::sort(found.open.begin(), found.open.end());
  return found;
}

}  // namespace

FacilitySolution facility_search(const FacilityMatrix& problem,
                                 const FacilitySearchOptions& options) {
  check(problem);
  if (options.restarts == 0) {
    throw std::invalid_argument("a search without restarts: give at least 1");
  }
  if (std::isnan(options.seconds)) {
    throw std::invalid_argument("the time limit is not a number: give seconds, or infinity");
  }
  const auto start = Clock::now();
  const MatrixRows costs(problem);
  std::vector<Found> found(options.restarts);
  parallel(options.restarts, options.threads, [&](std::size_t run) {
    found[run] = search(costs, options, static_cast<std::uint32_t>(run), start);
  });
  const auto best = std::min_element(
      found.begin(), found.end(), [](const Found& a, const Found& b) { return a.cost < b.cost; });
  return solution_of(problem, best->open);
}

}  // namespace terrace::cluster
