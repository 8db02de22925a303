// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/point_search.hpp"

#include <stdexcept>
#include <utility>

#include "make_search.hpp"

namespace terrace::cluster {
namespace {

const FacilityPoints& checked(const FacilityPoints& problem) {
  check(problem);
  return problem;
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
  const std::unique_ptr<SearchEngine> engine =
      make_search(problem, options.strategy, options.threads);
  return run_search(*engine, options, statistics);
}

PointSearch::PointSearch(const FacilityPoints& problem, GainStrategy strategy, unsigned threads)
    : engine_(make_search(checked(problem), strategy, threads)) {}
PointSearch::PointSearch(std::unique_ptr<SearchEngine> engine) : engine_(std::move(engine)) {}
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
