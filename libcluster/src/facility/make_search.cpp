// SPDX-License-Identifier: Apache-2.0
#include "facility/make_search.hpp"

#include <cmath>
#include <random>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "facility/search_frame.hpp"
#include "facility/space_search.hpp"

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

// The caller's function on positions as they are; channels join under the root.
IndexSpace custom_space(const FacilityPoints& problem, const SearchFrame& frame,
                        const CustomMetric& metric) {
  auto distance = [points = std::vector<Point3>(problem.points.begin(), problem.points.end()),
                   channels = frame.channels, count = frame.channel_count,
                   function = metric.distance](std::uint32_t facility, std::uint32_t client) {
    double d = function(points[facility], points[client]);
    for (std::size_t c = 0; c < count && d >= 0.0; ++c) {
      d = std::hypot(d, channels[facility * count + c] - channels[client * count + c]);
    }
    return d;
  };
  return {std::move(distance), metric.symmetric && metric.triangle_inequality};
}

}  // namespace

std::unique_ptr<SearchEngine> make_search(const FacilityPoints& problem, GainStrategy strategy,
                                          unsigned threads) {
  SearchFrame frame = make_frame(problem);
  const std::string what = "the metric \"" + name_of(problem.metric) + "\"";
  const auto norm_search = [&](auto norm, bool triangles) {
    return make(frame, NormSpace<decltype(norm), true>(frame, norm, triangles), strategy, threads,
                what);
  };
  if (linear_map(problem.metric, bounds_of(problem.points))) {
    if (frame.channel_count > 0) return norm_search(EuclideanNorm{}, true);
    return make(frame, NormSpace<EuclideanNorm, false>(frame, {}, true), strategy, threads, what);
  }
  return std::visit(
      [&](const auto& metric) -> std::unique_ptr<SearchEngine> {
        using M = std::decay_t<decltype(metric)>;
        if constexpr (std::is_same_v<M, Minkowski>) {
          if (std::isinf(metric.p)) return norm_search(MaximumNorm{}, true);
          if (metric.p == 1.0) return norm_search(CityBlockNorm{}, true);
          return norm_search(PowerNorm{metric.p}, metric.p >= 1.0);
        } else if constexpr (std::is_same_v<M, EllipticalField>) {
          return make(frame, FieldSpace(frame, problem.points, metric), strategy, threads, what);
        } else if constexpr (std::is_same_v<M, CustomMetric>) {
          return make(frame, custom_space(problem, frame, metric), strategy, threads, what);
        } else {
          return norm_search(SquaredNorm{}, false);
        }
      },
      problem.metric);
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
