// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/point_search.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "block/linear_block.hpp"
#include "facility/make_search.hpp"
#include "facility/search_frame.hpp"
#include "terrace/cluster/block.hpp"

namespace terrace::cluster {
namespace {

const FacilityPoints& checked(const FacilityPoints& problem) {
  check(problem);
  return problem;
}

Effort effort_of(SearchLength length) {
  switch (length) {
    case SearchLength::tenth:
      return Effort::standard;
    case SearchLength::log10_full:
      return Effort::fine;
    case SearchLength::log2_full:
      break;
  }
  return Effort::full;
}

FacilitySolution search_fast(const FacilityPoints& problem, const PointSearchOptions& options,
                             PointSearchStatistics* statistics) {
  const auto refuse = [](const std::string& why, const std::string& remedy) {
    throw std::invalid_argument("the strategy \"fast\" " + why + ": " + remedy);
  };
  if (problem.points.size() >= (std::size_t{1} << 24)) {
    refuse("takes fewer than 2^24 points", "cluster them in blocks (hierarchy.hpp)");
  }
  if (!linear_map(problem.metric, bounds_of(problem.points))) {
    refuse("needs a metric that a linear map of the points makes Euclidean, and \"" +
               name_of(problem.metric) + "\" is none on these points",
           "take automatic");
  }
  if (problem.channels.size() > 0) refuse("has no channels", "take automatic");
  if (std::isfinite(problem.outlier_price)) refuse("leaves nobody out", "take automatic");
  if (options.start) refuse("has a start of its own", "take automatic");

  BlockClusterer clusterer;
  BlockClustering clustering;
  run_linear(clusterer, problem, effort_of(options.length), options.seed, clustering);
  FacilitySolution solution;
  solution.facilities = std::move(clustering.facilities);
  solution.assignment = std::move(clustering.assignment);
  // Costs in double precision, clusters by ascending facility.
  const auto engine = make_search(problem, GainStrategy::full_scan, 1);
  engine->start(solution);
  if (statistics) {
    *statistics = {};
    statistics->wrongly_assigned = engine->wrongly_assigned();
  }
  if (options.assign_nearest) engine->assign_nearest();
  return engine->state().solution();
}

}  // namespace

const char* name_of(GainStrategy strategy) {
  switch (strategy) {
    case GainStrategy::automatic:
      return "automatic";
    case GainStrategy::full_scan:
      return "full scan";
    case GainStrategy::quadtree:
      return "quadtree";
    case GainStrategy::octree:
      return "octree";
    case GainStrategy::kd_tree:
      return "kd-tree";
    case GainStrategy::facilities:
      return "facilities";
    case GainStrategy::fast:
      break;
  }
  return "fast";
}

GainStrategy best_strategy(const FacilityPoints& problem) {
  if (linear_map(problem.metric, bounds_of(problem.points)) ||
      (is_symmetric(problem.metric) && obeys_triangle_inequality(problem.metric))) {
    return GainStrategy::facilities;
  }
  return std::holds_alternative<CustomMetric>(problem.metric) ? GainStrategy::full_scan
                                                              : GainStrategy::kd_tree;
}

FacilitySolution search_points(const FacilityPoints& problem, const PointSearchOptions& options,
                               PointSearchStatistics* statistics) {
  check(problem);
  if (options.strategy == GainStrategy::fast) return search_fast(problem, options, statistics);
  const std::unique_ptr<SearchEngine> engine =
      make_search(problem, options.strategy, options.threads);
  return run_search(*engine, options, statistics);
}

PointSearch::PointSearch(const FacilityPoints& problem, GainStrategy strategy, unsigned threads)
    : engine_(make_search(checked(problem), strategy, threads)) {}
PointSearch::~PointSearch() = default;
PointSearch::PointSearch(PointSearch&&) noexcept = default;
PointSearch& PointSearch::operator=(PointSearch&&) noexcept = default;

void PointSearch::start(std::mt19937_64& random) { engine_->start(random); }
void PointSearch::start(const FacilitySolution& solution) { engine_->start(solution); }
double PointSearch::gain(std::uint32_t candidate) { return engine_->gain(candidate); }
void PointSearch::open(std::uint32_t candidate) { engine_->open(candidate); }
bool PointSearch::improve(std::size_t candidates, std::mt19937_64& random, std::size_t batch,
                          const std::function<bool(std::size_t, std::size_t)>& progress) {
  return engine_->improve(candidates, random, batch, progress);
}
void PointSearch::assign_nearest() { engine_->assign_nearest(); }
std::size_t PointSearch::wrongly_assigned() const { return engine_->wrongly_assigned(); }
double PointSearch::cost() const { return engine_->state().unscaled(engine_->state().cost()); }
std::size_t PointSearch::facility_count() const { return engine_->state().open().size(); }
FacilitySolution PointSearch::solution() const { return engine_->state().solution(); }
PointSearchStatistics PointSearch::statistics() const { return engine_->statistics(); }

}  // namespace terrace::cluster
