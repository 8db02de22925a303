// SPDX-License-Identifier: Apache-2.0
#include "facility/points/local_search.hpp"

#include <algorithm>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>

#include <terrace/base/stop_check.hpp>

#include "facility/points/search_frame.hpp"
#include "facility/points/space_choice.hpp"
#include "facility/points/space_search.hpp"

namespace terrace::cluster {
namespace {

void check_strategy(FacilityStrategy strategy, bool has_boxes, bool has_triangles,
                    const std::string& what) {
  const std::string prefix = std::string("the strategy \"") + name_of(strategy) + "\" ";
  switch (strategy) {
    case FacilityStrategy::quadtree:
    case FacilityStrategy::octree:
    case FacilityStrategy::kd_tree:
      if (has_boxes) return;
      throw std::invalid_argument(prefix +
                                  "needs bounds on distances to boxes, which do not exist for " +
                                  what + ": use automatic or full_scan");
    case FacilityStrategy::facilities:
      if (has_triangles) return;
      throw std::invalid_argument(
          prefix + "needs distances that are symmetric and obey the triangle inequality, and " +
          what + " does not (or does not declare it): use automatic" +
          (has_boxes ? ", kd_tree" : "") + " or full_scan");
    case FacilityStrategy::automatic:
    case FacilityStrategy::full_scan:
      return;
    default:
      throw std::invalid_argument(prefix + "is not a local search on " + what +
                                  ": use automatic or full_scan");
  }
}

std::size_t ceil_log(std::size_t value, std::size_t base) {
  std::size_t exponent = 0;
  for (std::size_t power = 1; power < value; ++exponent) {
    if (power > value / base) return exponent + 1;
    power *= base;
  }
  return exponent;
}

template <class Space>
std::unique_ptr<SearchEngine> make(SearchFrame& frame, Space space, FacilityStrategy strategy,
                                   unsigned threads, const base::StopCheck& check_stop,
                                   const std::string& what) {
  check_strategy(strategy, Space::kHasBoxes, space.has_triangles(), what);
  if (strategy == FacilityStrategy::automatic) {
    strategy = space.has_triangles() ? FacilityStrategy::facilities
               : Space::kHasBoxes    ? FacilityStrategy::kd_tree
                                     : FacilityStrategy::full_scan;
  }
  return std::make_unique<SpaceSearch<Space>>(frame, std::move(space), strategy, threads,
                                              check_stop);
}

}  // namespace

std::unique_ptr<SearchEngine> make_search(const FacilityPoints& problem, FacilityStrategy strategy,
                                          unsigned threads, const base::StopCheck& check_stop) {
  SearchFrame frame = make_frame(problem);
  const std::string what = "the metric \"" + name_of(problem.metric) + "\"";
  return visit_space(problem, frame, problem.points,
                     [&](auto space) -> std::unique_ptr<SearchEngine> {
                       return make(frame, std::move(space), strategy, threads, check_stop, what);
                     });
}

std::unique_ptr<SearchEngine> make_search(const FacilityEntities& problem,
                                          FacilityStrategy strategy, unsigned threads,
                                          const base::StopCheck& check_stop) {
  SearchFrame frame = make_frame(problem);
  return make(frame, space_of(problem), strategy, threads, check_stop, "distances by a function");
}

std::size_t candidate_count(Effort effort, std::size_t points) {
  switch (effort) {
    case Effort::fast:
    case Effort::standard:
      return std::max<std::size_t>(points / 10, points > 0 ? 1 : 0);
    case Effort::fine:
      return points * std::max<std::size_t>(ceil_log(points, 10), 1);
    case Effort::full:
      break;
  }
  return points * std::max<std::size_t>(ceil_log(points, 2), 1);
}

FacilitySolution run_search(SearchEngine& engine, const FacilityOptions& options,
                            FacilityReport* report) {
  if (options.batch == 0) {
    throw std::invalid_argument("batch is 0: give at least 1, which is the plain search");
  }
  std::mt19937_64 random(options.seed);
  if (options.start) {
    engine.start(*options.start);
  } else {
    engine.start(random);
  }
  const std::size_t candidates =
      options.steps.value_or(candidate_count(options.effort, engine.size()));
  engine.improve(candidates, random, options.batch, options.progress);
  if (report) {
    report->strategy = engine.strategy();
    report->search = engine.statistics();
    report->search.wrongly_assigned = engine.wrongly_assigned();
  }
  if (options.assign_nearest) engine.assign_nearest();
  return engine.solution();
}

}  // namespace terrace::cluster
