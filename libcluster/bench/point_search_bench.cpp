// SPDX-License-Identifier: Apache-2.0
// Runs the strategies of the local search on blocks of 10,000 points, with a facility cost of 1
// diagonal and Meyerson's start:
//   <input>/<strategy>/<metric>          0.1 m candidates, one thread
//   <input>/<strategy>/threads:T         one gain by T threads
//   <input>/<strategy>/batch:B/threads:T several gains at once
// Inputs: scan (a patch of a bumpy surface), shuf (all of the surface, at random), cube. Times are
// for a complete search, including the start. Columns: ns per gain (the mean over the search
// without the start, including openings), fraction of positive gains, fraction of vertices (clients
// and facilities) inspected, Q relative to batch 1 in %, clients not at their nearest facility in
// %.
#include <chrono>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "../tests/inputs.hpp"
#include "facility/points/local_search.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace {

using namespace terrace::cluster;

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;
const std::size_t kPoints = kSmall ? 300 : 10000;

const std::vector<Point3>& input(std::size_t which) {
  static const auto all = [] {
    std::mt19937_64 random(20);
    std::vector<std::vector<Point3>> sets(3);
    const auto surface = kSmall ? inputs::scan(2, 40, random) : inputs::scan(4, 100, random);
    sets[0].assign(surface.begin(), surface.begin() + static_cast<std::ptrdiff_t>(kPoints));
    sets[1] = surface;
    inputs::shuffle(sets[1], random);
    sets[1].resize(kPoints);
    sets[2] = inputs::cube(kPoints, random);
    return sets;
  }();
  return all[which];
}

constexpr const char* kInputs[] = {"scan", "shuf", "cube"};

struct Setting {
  FacilityStrategy strategy = FacilityStrategy::full_scan;
  Metric metric = Euclidean{};
  unsigned threads = 1;
  std::size_t batch = 1;
};

void search(benchmark::State& state, std::size_t which, const Setting& setting) {
  const FacilityPoints problem{.points = input(which), .metric = setting.metric};
  FacilityOptions options;
  options.strategy = setting.strategy;
  options.threads = setting.threads;
  options.batch = setting.batch;
  using Clock = std::chrono::steady_clock;
  double seconds = 0.0;
  std::size_t gains = 0;
  FacilityReport report;
  double cost = 0.0;
  for ([[maybe_unused]] const auto iteration : state) {
    std::mt19937_64 random(options.seed);
    const auto engine = make_search(problem, options.strategy, options.threads);
    engine->start(random);
    const auto begin = Clock::now();
    engine->improve(candidate_count(options.effort, kPoints), random, options.batch);
    seconds += std::chrono::duration<double>(Clock::now() - begin).count();
    gains += engine->statistics().candidates;
    benchmark::DoNotOptimize(engine->cost());
  }
  cost = solve(problem, options, &report).cost();
  const double reference =
      solve(problem, {.strategy = options.strategy, .seed = options.seed}).cost();
  state.counters["ns_per_gain"] = 1e9 * seconds / static_cast<double>(gains);
  state.counters["positive"] = report.search.positive_share();
  state.counters["inspected"] = report.search.inspected_share();
  state.counters["Q_%"] = 100.0 * (cost / reference - 1.0);
  state.counters["wrong_%"] =
      100.0 * static_cast<double>(report.search.wrongly_assigned) / static_cast<double>(kPoints);
}

/// Runs the production engine on the same block.
void fast(benchmark::State& state, std::size_t which) {
  const FacilityPoints problem{.points = input(which)};
  double cost = 0.0;
  for ([[maybe_unused]] const auto iteration : state) {
    cost = solve(problem, {.strategy = FacilityStrategy::fast}).cost();
  }
  const double reference = solve(problem, {}).cost();
  state.counters["Q_%"] = 100.0 * (cost / reference - 1.0);
}

}  // namespace

int main(int argc, char** argv) {
  const EllipticalField field({{{{-2, -2, -2}, {0.5, 0.5, 2}}, Elliptical(2.0, 0.7, 30.0)},
                               {{{0.5, 0.5, -2}, {2, 2, 2}}, Elliptical(0.7, 2.0, 0.0)}});
  const std::vector<std::pair<FacilityStrategy, Metric>> plain{
      {FacilityStrategy::full_scan, Euclidean{}},
      {FacilityStrategy::quadtree, Euclidean{}},
      {FacilityStrategy::octree, Euclidean{}},
      {FacilityStrategy::kd_tree, Euclidean{}},
      {FacilityStrategy::facilities, Euclidean{}},
      {FacilityStrategy::full_scan, Minkowski{1.0}},
      {FacilityStrategy::kd_tree, Minkowski{1.0}},
      {FacilityStrategy::facilities, Minkowski{1.0}},
      {FacilityStrategy::full_scan, SquaredEuclidean{}},
      {FacilityStrategy::kd_tree, SquaredEuclidean{}},
      {FacilityStrategy::full_scan, field},
      {FacilityStrategy::kd_tree, field},
      {FacilityStrategy::facilities, Elliptical(2, 1, 30)}};
  for (std::size_t which = 0; which < 3; ++which) {
    const std::string name = std::string(kInputs[which]) + "/";
    const auto add = [&](const std::string& setting, const Setting& values) {
      benchmark::RegisterBenchmark((name + setting).c_str(), search, which, values)
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime();
    };
    for (const auto& [strategy, metric] : plain) {
      add(std::string(name_of(strategy)) + "/" + name_of(metric), {strategy, metric});
    }
    for (const FacilityStrategy strategy :
         {FacilityStrategy::full_scan, FacilityStrategy::facilities}) {
      const std::string prefix = std::string(name_of(strategy)) + "/";
      add(prefix + "threads:2", {strategy, Euclidean{}, 2});
      for (const std::size_t batch : {std::size_t{4}, std::size_t{16}}) {
        for (const unsigned threads : {1u, 2u}) {
          add(prefix + "batch:" + std::to_string(batch) + "/threads:" + std::to_string(threads),
              {strategy, Euclidean{}, threads, batch});
        }
      }
    }
    benchmark::RegisterBenchmark((name + "fast").c_str(), fast, which)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
