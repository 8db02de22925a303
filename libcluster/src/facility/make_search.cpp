// SPDX-License-Identifier: Apache-2.0
#include "facility/make_search.hpp"

#include <random>
#include <stdexcept>
#include <string>
#include <utility>

#include "facility/search_frame.hpp"
#include "facility/space_search.hpp"
#include "facility/with_space.hpp"

namespace terrace::cluster {
namespace {

void check_strategy(GainStrategy strategy, bool has_boxes, bool has_triangles,
                    const std::string& what) {
  const std::string asked = std::string("the strategy \"") + name_of(strategy) + "\" ";
  switch (strategy) {
    case GainStrategy::quadtree:
    case GainStrategy::octree:
    case GainStrategy::kd_tree:
      if (has_boxes) return;
      throw std::invalid_argument(asked +
                                  "needs bounds on distances to boxes, and there are none of " +
                                  what + ": take automatic or full_scan");
    case GainStrategy::facilities:
      if (has_triangles) return;
      throw std::invalid_argument(
          asked + "needs distances that are symmetric and obey the triangle inequality, and " +
          what + " does not (or does not declare it): take automatic" +
          (has_boxes ? ", kd_tree" : "") + " or full_scan");
    case GainStrategy::fast:
      throw std::invalid_argument(asked + "is a search of its own: see search_points()");
    case GainStrategy::automatic:
    case GainStrategy::full_scan:
      return;
  }
}

template <class Space>
std::unique_ptr<SearchEngine> make(SearchFrame& frame, Space space, GainStrategy strategy,
                                   unsigned threads, const std::string& what) {
  check_strategy(strategy, Space::kHasBoxes, space.has_triangles(), what);
  if (strategy == GainStrategy::automatic) {
    strategy = space.has_triangles() ? GainStrategy::facilities
               : Space::kHasBoxes    ? GainStrategy::kd_tree
                                     : GainStrategy::full_scan;
  }
  return std::make_unique<SpaceSearch<Space>>(frame, std::move(space), strategy, threads);
}

}  // namespace

std::unique_ptr<SearchEngine> make_search(const FacilityPoints& problem, GainStrategy strategy,
                                          unsigned threads) {
  SearchFrame frame = make_frame(problem);
  const std::string what = "the metric \"" + name_of(problem.metric) + "\"";
  return with_space(problem, frame, problem.points,
                    [&](auto space) -> std::unique_ptr<SearchEngine> {
                      return make(frame, std::move(space), strategy, threads, what);
                    });
}

std::unique_ptr<SearchEngine> make_search(SearchFrame& frame, IndexSpace space,
                                          GainStrategy strategy, unsigned threads) {
  return make(frame, std::move(space), strategy, threads, "distances by a function");
}

FacilitySolution run_search(SearchEngine& engine, const PointSearchOptions& options,
                            PointSearchStatistics* statistics) {
  if (options.batch == 0) {
    throw std::invalid_argument("a batch of 0 candidates: 1 is the plain search");
  }
  std::mt19937_64 random(options.seed);
  if (options.start) {
    engine.start(*options.start);
  } else {
    engine.start(random);
  }
  const std::size_t candidates =
      options.iterations.value_or(candidate_count(options.length, engine.state().size()));
  engine.improve(candidates, random, options.batch, options.progress);
  if (statistics) {
    *statistics = engine.statistics();
    statistics->wrongly_assigned = engine.wrongly_assigned();
  }
  if (options.assign_nearest) engine.assign_nearest();
  return engine.state().solution();
}

}  // namespace terrace::cluster
