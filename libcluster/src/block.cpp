// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/block.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <vector>

#include <terrace/base/simd.hpp>
#include <terrace/base/stop_check.hpp>

#include "block/engine.hpp"
#include "block/linear_block.hpp"
#include "block/state.hpp"
#include "facility/points/local_search.hpp"
#include "scaling.hpp"

namespace terrace::cluster {
namespace {

EngineFunction engine_of(SimdPath path) {
#ifdef TERRACE_CLUSTER_X86
  if (path == SimdPath::avx2) return run_engine_avx2;
  if (path == SimdPath::avx512) return run_engine_avx512;
#else
  (void)path;
#endif
  return run_engine_portable;
}

/// Drops facilities without clients. There is one wherever two facilities have equal positions,
/// because all clients choose the one with the lower number.
void drop_empty_facilities(BlockState& state) {
  std::uint32_t* const new_number = state.nearby;
  std::fill_n(new_number, state.facility_count, 0u);
  for (std::uint32_t i = 0; i < state.count; ++i) new_number[state.nearest[i]] = 1;
  std::uint32_t count = 0;
  for (std::uint32_t j = 0; j < state.facility_count; ++j) {
    const bool has_clients = new_number[j] != 0;
    new_number[j] = count;
    if (has_clients) state.facility[count++] = state.facility[j];
  }
  if (count == state.facility_count) return;
  state.facility_count = count;
  for (std::uint32_t i = 0; i < state.count; ++i) state.nearest[i] = new_number[state.nearest[i]];
}

double mean_of(std::span<const double> weights) {
  if (weights.empty()) return 1.0;
  // Divides before adding, because the sum itself may exceed the range of double.
  const double share = 1.0 / static_cast<double>(weights.size());
  double mean = 0.0;
  for (const double w : weights) mean += w * share;
  return std::max(mean, std::numeric_limits<double>::min());
}

SearchPlan plan_of(const BlockOptions& options, std::size_t count) {
  SearchPlan plan;
  plan.seed = options.seed;
  const Effort effort = count < kFullSearchBelow ? Effort::full : options.effort;
  switch (effort) {
    case Effort::fast:
      plan.candidates = 1.5f;
      plan.max_spacing = 32;
      break;
    case Effort::standard:
      plan.candidates = 3.0f;
      plan.max_spacing = 32;
      plan.polish = 2;
      break;
    case Effort::fine:
      plan.candidates = 4.0f;
      plan.max_spacing = 16;
      plan.sweeps = 3;
      plan.polish = 3;
      break;
    case Effort::full:
      plan.random_candidates = static_cast<std::uint32_t>(candidate_count(Effort::full, count));
      plan.polish = 3;
      break;
  }
  return plan;
}

double distance(const Point3& a, const Point3& b) {
  const double x = a[0] - b[0];
  const double y = a[1] - b[1];
  const double z = a[2] - b[2];
  return std::sqrt(x * x + y * y + z * z);
}

/// The last step of clustering a block, in double precision. It adds up the cost. It also opens
/// facilities at points that pay more than a facility costs although single precision cannot
/// distinguish them from their facility. Such points are close to it and have great weights.
class ExactFinish {
 public:
  /// Adds facilities to `clustering` and reassigns points if necessary. facility_cost is scaled.
  /// Returns the scaled connection cost. Throws whatever the stop check throws.
  double run(std::span<const Point3> points, std::span<const double> weights,
             const Scaling& scaling, double facility_cost, const base::StopCheck& check_stop,
             BlockClustering& clustering);

 private:
  struct Costs {
    double sum = 0.0, largest = 0.0;
    std::uint32_t costliest = 0;  ///< the point with the largest cost
  };
  [[nodiscard]] Costs costs(std::span<const Point3> points, std::span<const double> weights,
                            const Scaling& scaling, const BlockClustering& clustering) const;

  std::vector<Point3> facilities_;  // scaled
};

ExactFinish::Costs ExactFinish::costs(std::span<const Point3> points,
                                      std::span<const double> weights, const Scaling& scaling,
                                      const BlockClustering& clustering) const {
  Costs costs;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double c = distance(scaling.scaled(points[i]), facilities_[clustering.assignment[i]]);
    if (!weights.empty()) c *= weights[i];
    costs.sum += c;
    if (c > costs.largest) {
      costs.largest = c;
      costs.costliest = static_cast<std::uint32_t>(i);
    }
  }
  return costs;
}

double ExactFinish::run(std::span<const Point3> points, std::span<const double> weights,
                        const Scaling& scaling, double facility_cost,
                        const base::StopCheck& check_stop, BlockClustering& clustering) {
  facilities_.clear();
  for (const std::uint32_t f : clustering.facilities) {
    facilities_.push_back(scaling.scaled(points[f]));
  }
  Costs current = costs(points, weights, scaling, clustering);
  while (current.largest > facility_cost) {
    if (check_stop) check_stop();
    // The new cluster follows the one that it splits, which keeps neighbours together.
    const std::uint32_t number = clustering.assignment[current.costliest] + 1;
    const Point3 position = scaling.scaled(points[current.costliest]);
    facilities_.insert(facilities_.begin() + number, position);
    clustering.facilities.insert(clustering.facilities.begin() + number, current.costliest);
    for (std::size_t i = 0; i < points.size(); ++i) {
      std::uint32_t& a = clustering.assignment[i];
      if (a >= number) ++a;
      const Point3 p = scaling.scaled(points[i]);
      if (distance(p, position) < distance(p, facilities_[a])) a = number;
    }
    current = costs(points, weights, scaling, clustering);
  }
  return current.sum;
}

}  // namespace

struct BlockClusterer::Impl {
  EngineFunction engine;
  CurveSorter sorter;
  BlockState state;
  ExactFinish finish;
};

BlockClusterer::BlockClusterer(SimdPath path) : impl_(std::make_unique<Impl>()) {
  if (path == SimdPath::automatic) path = best_simd_path();
  if (!base::supports(path)) {
    throw std::invalid_argument(
        "this processor lacks the instructions of the requested SIMD path; "
        "SimdPath::automatic takes the best available");
  }
  impl_->engine = engine_of(path);
}
BlockClusterer::~BlockClusterer() = default;
BlockClusterer::BlockClusterer(BlockClusterer&&) noexcept = default;
BlockClusterer& BlockClusterer::operator=(BlockClusterer&&) noexcept = default;

void BlockClusterer::run(std::span<const Point3> points, std::span<const double> weights,
                         const BlockOptions& options, BlockClustering& result) {
  assert(weights.empty() || weights.size() == points.size());
  assert(points.size() < (std::size_t{1} << 24));
  assert(options.facility_cost > 0);
  result.facilities.clear();
  result.assignment.assign(points.size(), 0);
  result.facility_cost = result.connection_cost = 0.0;
  if (points.empty()) return;
  const Scaling scaling(points);
  if (scaling.diagonal == 0.0) {
    result.facilities.push_back(0);
    return;
  }

  // With weights of mean 1 no sum of weights leaves the range of float. Any facility cost above the
  // sum of all distances leads to one facility.
  const double mean_weight = mean_of(weights);
  const double facility_cost = options.facility_cost * scaling.diagonal;
  BlockState& state = impl_->state;
  state.check_stop = &options.check_stop;
  state.facility_cost = static_cast<float>(std::min(facility_cost / mean_weight, 1e8));
  impl_->sorter.load(points, weights, mean_weight, scaling, state);
  impl_->engine(state, plan_of(options, points.size()));
  drop_empty_facilities(state);

  for (std::uint32_t i = 0; i < state.count; ++i) {
    result.assignment[state.original[i]] = state.nearest[i];
  }
  for (std::uint32_t j = 0; j < state.facility_count; ++j) {
    result.facilities.push_back(state.original[state.facility[j]]);
  }
  const double connections =
      impl_->finish.run(points, weights, scaling, facility_cost, options.check_stop, result);
  result.facility_cost = scaling.unscaled(facility_cost);
  result.connection_cost = scaling.unscaled(connections);
}

}  // namespace terrace::cluster
