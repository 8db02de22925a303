// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/block.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>

#include "block_state.hpp"
#include "engine.hpp"
#include "scaling.hpp"
#include "terrace/cluster/local_search.hpp"

namespace terrace::cluster {
namespace {

constexpr std::size_t kFullBelow = 2500;

bool available(SimdPath path) {
#ifdef TERRACE_CLUSTER_X86
  if (path == SimdPath::avx2) return __builtin_cpu_supports("avx2") != 0;
  if (path == SimdPath::avx512) {
    return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0;
  }
#endif
  return path == SimdPath::portable;
}

EngineFunction engine_of(SimdPath path) {
#ifdef TERRACE_CLUSTER_X86
  if (path == SimdPath::avx2) return run_engine_avx2;
  if (path == SimdPath::avx512) return run_engine_avx512;
#else
  (void)path;
#endif
  return run_engine_portable;
}

double distance(const Point3& a, const Point3& b) {
  const double x = a[0] - b[0];
  const double y = a[1] - b[1];
  const double z = a[2] - b[2];
  return std::sqrt(x * x + y * y + z * z);
}

/// A facility at the same place as one of lower number has no clients.
void drop_empty_facilities(BlockState& state) {
  for (std::uint32_t j = 0; j < state.facility_count; ++j) state.size[j] = 0;
  for (std::uint32_t i = 0; i < state.count; ++i) ++state.size[state.nearest[i]];
  std::uint32_t kept = 0;
  for (std::uint32_t j = 0; j < state.facility_count; ++j) {
    state.near[j] = kept;
    if (state.size[j] != 0) state.facility[kept++] = state.facility[j];
  }
  if (kept == state.facility_count) return;
  state.facility_count = kept;
  for (std::uint32_t i = 0; i < state.count; ++i) state.nearest[i] = state.near[state.nearest[i]];
}

}  // namespace

struct BlockClusterer::Impl {
  EngineFunction engine;
  CurveSorter sorter;
  BlockState state;
};

BlockClusterer::BlockClusterer(SimdPath path) : impl_(std::make_unique<Impl>()) {
  if (path == SimdPath::automatic) path = best_simd_path();
  if (!available(path)) {
    throw std::invalid_argument(
        "this processor lacks the instructions of the SIMD path asked for; "
        "SimdPath::automatic takes the best there is");
  }
  impl_->engine = engine_of(path);
}
BlockClusterer::~BlockClusterer() = default;
BlockClusterer::BlockClusterer(BlockClusterer&&) noexcept = default;
BlockClusterer& BlockClusterer::operator=(BlockClusterer&&) noexcept = default;

void BlockClusterer::run(std::span<const Point3> points, std::span<const double> weights,
                         const BlockOptions& options, BlockClustering& result) {
  assert(weights.empty() || weights.size() == points.size());
  result.facilities.clear();
  result.assignment.resize(points.size());
  result.facility_cost = result.connection_cost = 0.0;
  if (points.empty()) return;

  BlockState& state = impl_->state;
  const Scaling scaling(points);
  impl_->sorter.load(points, weights, scaling, state);
  state.facility_cost = static_cast<float>(options.facility_cost * scaling.diagonal);

  SearchPlan plan;
  plan.seed = options.seed;
  const auto count = points.size();
  if (count < kFullBelow || options.effort == Effort::full) {
    plan.random_candidates =
        static_cast<std::uint32_t>(candidate_count(SearchLength::log2_full, count));
  } else if (options.effort == Effort::fast) {
    plan.stride = 3;
  } else if (options.effort == Effort::standard) {
    plan.stride = 1;
  } else {
    plan.stride = 1;
    plan.sweeps = 3;
  }
  impl_->engine(state, plan);

  drop_empty_facilities(state);
  for (std::uint32_t i = 0; i < state.count; ++i) {
    result.assignment[state.original[i]] = state.nearest[i];
  }
  for (std::uint32_t j = 0; j < state.facility_count; ++j) {
    result.facilities.push_back(state.original[state.facility[j]]);
  }
  double connections = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double d = distance(scaling.scaled(points[i]),
                              scaling.scaled(points[result.facilities[result.assignment[i]]]));
    connections += weights.empty() ? d : weights[i] * d;
  }
  result.facility_cost = scaling.unscaled(options.facility_cost * scaling.diagonal);
  result.connection_cost = scaling.unscaled(connections);
}

SimdPath best_simd_path() {
  for (const SimdPath path : {SimdPath::avx512, SimdPath::avx2}) {
    if (available(path)) return path;
  }
  return SimdPath::portable;
}

}  // namespace terrace::cluster
