// SPDX-License-Identifier: Apache-2.0
// Builds the hierarchy of complete streams, from positions in memory to the root, all levels, with
// a sink that discards everything. The inputs are square tiles of a fractal elevation model and a
// shuffled scan of a closed surface. The overhead is measured with a clustering that costs almost
// nothing.
#include <algorithm>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <random>
#include <span>
#include <vector>

#include <benchmark/benchmark.h>

#include "../tests/inputs.hpp"
#include "hierarchy/engine.hpp"
#include "terrace/cluster/hierarchy.hpp"

namespace terrace::cluster {
namespace {

bool small() { return std::getenv("TERRACE_BENCH_SMALL") != nullptr; }

class NullSink : public HierarchySink {
 public:
  std::unique_ptr<Prepared> prepare(const ClusteredBlock&) override { return nullptr; }
  void commit(unsigned, std::unique_ptr<Prepared>) override {}
  void root(const ClusteredBlock&) override {}
};

constexpr std::size_t kTile = 100;  // a tile is a block

const std::vector<Point3>& terrain_tiles() {
  static const std::vector<Point3> points = [] {
    std::mt19937_64 random(1);
    return inputs::dem_tiles(small() ? 2 * kTile : 20 * kTile, kTile, 30.0, 10.0, random);
  }();
  return points;
}

const std::vector<Point3>& shuffled_scan() {
  static const std::vector<Point3> points = [] {
    std::mt19937_64 random(2);
    std::vector<Point3> scan = inputs::scan(small() ? 2 : 28, 100, random);
    inputs::shuffle(scan, random);
    return scan;
  }();
  return points;
}

template <class Builder>
void push_all(Builder& builder, const std::vector<Point3>& points) {
  for (std::size_t i = 0; i < points.size(); i += kTile * kTile) {
    builder.push(std::span(points).subspan(i, std::min(kTile * kTile, points.size() - i)), {});
  }
}

void report(benchmark::State& state, const HierarchyResult& result) {
  state.SetItemsProcessed(static_cast<std::int64_t>(result.points) * state.iterations());
  state.counters["levels"] = static_cast<double>(result.top + 1);
  state.counters["reduction"] = static_cast<double>(result.points) /
                                static_cast<double>(result.level_points[std::min(1u, result.top)]);
}

void stream(benchmark::State& state, const std::vector<Point3>& points) {
  HierarchyResult result;
  for (auto _ : state) {
    NullSink sink;
    HierarchyOptions options;
    options.threads = static_cast<unsigned>(state.range(0));
    HierarchyBuilder builder(options, sink);
    push_all(builder, points);
    result = builder.finish();
  }
  report(state, result);
}

void hierarchy_terrain_tiles(benchmark::State& state) { stream(state, terrain_tiles()); }
void hierarchy_shuffled_scan(benchmark::State& state) { stream(state, shuffled_scan()); }

// Other metrics, on 400,000 points of the shuffled scan. The elliptical metric is linear; the
// others need local searches.
const Metric& metric_of(std::int64_t which) {
  static const std::vector<Metric> metrics{
      Elliptical(2.0, 0.5, 30.0), Minkowski{1.0}, SquaredEuclidean{},
      EllipticalField({{{{-2, -2, -2}, {0, 2, 2}}, Elliptical(2.0, 0.5, 30.0)}})};
  return metrics[static_cast<std::size_t>(which)];
}

void hierarchy_metric(benchmark::State& state) {
  const std::vector<Point3>& scan = shuffled_scan();
  const std::vector<Point3> points(
      scan.begin(), scan.begin() + static_cast<std::ptrdiff_t>(
                                       std::min<std::size_t>(scan.size(), 40 * kTile * kTile)));
  state.SetLabel(name_of(metric_of(state.range(0))));
  HierarchyResult result;
  for (auto _ : state) {
    NullSink sink;
    HierarchyOptions options;
    options.metric = metric_of(state.range(0));
    HierarchyBuilder builder(options, sink);
    push_all(builder, points);
    result = builder.finish();
  }
  report(state, result);
}

// Measures everything except the clustering. Clusters have about 100 points, a typical size.
// Neighbours in the block are in different clusters, as in a shuffled scan.
void hierarchy_overhead(benchmark::State& state) {
  const std::vector<Point3>& points = shuffled_scan();
  const auto cluster = [](std::span<const Point3> block, std::span<const double>,
                          const BlockOptions&, BlockClustering& clustering) {
    const std::uint32_t clusters = static_cast<std::uint32_t>(block.size() / 100 + 1);
    clustering.facilities.resize(clusters);
    std::iota(clustering.facilities.begin(), clustering.facilities.end(), 0u);
    clustering.assignment.resize(block.size());
    std::uint32_t next = 0;
    for (std::uint32_t& c : clustering.assignment) {
      c = next;
      next = next + 1 < clusters ? next + 1 : 0;
    }
  };
  const bool mapped = state.range(0) != 0;
  HierarchyResult result;
  for (auto _ : state) {
    NullSink sink;
    HierarchyOptions options;
    if (mapped) {
      options.ground = [](const Box3&) { return GroundMap{2, 0, 0, 0, 3, 0, 0, 0, 1}; };
    }
    HierarchyEngine engine(options, sink, [&] { return cluster; });
    push_all(engine, points);
    result = engine.finish();
  }
  report(state, result);
}

BENCHMARK(hierarchy_terrain_tiles)
    ->ArgName("threads")
    ->Arg(1)
    ->Arg(2)
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(hierarchy_shuffled_scan)
    ->ArgName("threads")
    ->Arg(1)
    ->Arg(2)
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(hierarchy_metric)->ArgName("metric")->DenseRange(0, 3)->Unit(benchmark::kMillisecond);
BENCHMARK(hierarchy_overhead)->ArgName("map")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace terrace::cluster

BENCHMARK_MAIN();
