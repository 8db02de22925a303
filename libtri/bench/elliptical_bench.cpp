// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the elliptical triangulation with the Euclidean one, and with CGAL's
// Delaunay_triangulation_2 with EPICK on points that were mapped and rounded, in one run on the
// same points: 200,000 uniform ones, or the complete grid of 447 x 447 in random order. Also
// measures flips to three regions, of the whole triangulation and after removing and adding compact
// sets of 140 points.
//
// items_per_second counts points; CPU time, median of 5 rounds.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <random>
#include <vector>

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <benchmark/benchmark.h>

#include "terrace/tri/regional_delaunay2.hpp"

namespace {

namespace tri = terrace::tri;
using Point = std::array<double, 2>;

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;
const std::uint32_t kSide = kSmall ? 40 : 447;

enum Input { kUniform, kGrid };
enum Metric { kRound, kUpright, kSlanted, kFlat };

std::vector<Point> input_points(Input input) {
  std::mt19937_64 random(1);
  std::vector<Point> points;
  for (std::uint32_t j = 0; j < kSide; ++j) {
    for (std::uint32_t i = 0; i < kSide; ++i) {
      if (input == kGrid) {
        points.push_back({static_cast<double>(i), static_cast<double>(j)});
      } else {
        points.push_back({static_cast<double>(random() >> 11) * 0x1p-53 * kSide,
                          static_cast<double>(random() >> 11) * 0x1p-53 * kSide});
      }
    }
  }
  std::shuffle(points.begin(), points.end(), random);
  return points;
}

tri::LinearMap2 map_of(Metric metric) {
  switch (metric) {
    case kRound:
      return tri::kIdentityMap<2>;
    case kUpright:
      return tri::ellipse_map(5, 1, 0);
    case kSlanted:
      return tri::ellipse_map(5, 1, 30);
    default:
      return tri::ellipse_map(100, 1, 30);
  }
}

template <class Round>
void measure(benchmark::State& state, std::size_t points, Round round) {
  std::vector<double> seconds(kSmall ? 1 : 5);
  for (auto _ : state) {
    for (double& s : seconds) s = round();
    std::sort(seconds.begin(), seconds.end());
    state.SetIterationTime(seconds[seconds.size() / 2]);
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(points));
}

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void euclidean(benchmark::State& state) {
  const auto points = input_points(static_cast<Input>(state.range(0)));
  measure(state, points.size(), [&] {
    tri::Delaunay2<double> triangulation;
    const double start = cpu_seconds();
    triangulation.build(points);
    return cpu_seconds() - start;
  });
}

void elliptical(benchmark::State& state) {
  const auto points = input_points(static_cast<Input>(state.range(0)));
  measure(state, points.size(), [&] {
    tri::Delaunay2<double, tri::EllipticalMetric2> triangulation(
        map_of(static_cast<Metric>(state.range(1))));
    const double start = cpu_seconds();
    triangulation.build(points);
    return cpu_seconds() - start;
  });
}

void cgal_mapped(benchmark::State& state) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  const auto points = input_points(static_cast<Input>(state.range(0)));
  const tri::LinearMap2 m = map_of(static_cast<Metric>(state.range(1)));
  measure(state, points.size(), [&] {
    const double start = cpu_seconds();
    std::vector<Kernel::Point_2> mapped;
    mapped.reserve(points.size());
    for (const auto& [x, y] : points) mapped.emplace_back(m[0] * x + m[1] * y, m[2] * x + m[3] * y);
    const CGAL::Delaunay_triangulation_2<Kernel> triangulation(mapped.begin(), mapped.end());
    return cpu_seconds() - start;
  });
}

/// Three boxes that cover most of the square, with ellipses of the given ratio.
tri::MetricField2 three_regions(double ratio) {
  const double side = kSide;
  return tri::MetricField2(
      {{tri::box2(0, 0, 0.5 * side, 0.6 * side), tri::ellipse_map(ratio, 1, 30)},
       {tri::box2(0.5 * side, 0, side, 0.6 * side), tri::ellipse_map(ratio, 1, 90)},
       {tri::box2(0, 0.7 * side, side, side), tri::ellipse_map(ratio, 1, -45)}});
}

void regions(benchmark::State& state) {
  const auto points = input_points(static_cast<Input>(state.range(0)));
  const tri::MetricField2 field = three_regions(static_cast<double>(state.range(1)));
  tri::Delaunay2<double> triangulation;
  triangulation.build(points);
  measure(state, points.size(), [&] {
    const double start = cpu_seconds();
    benchmark::DoNotOptimize(tri::metric_triangles(triangulation, field));
    return cpu_seconds() - start;
  });
}

/// Removes compact sets of 140 points and adds them again, taking the changes each time. Items are
/// points removed and added.
template <class Triangulation>
void sets(benchmark::State& state, Triangulation triangulation) {
  const auto points = input_points(static_cast<Input>(state.range(0)));
  const std::vector<tri::VertexId> built = triangulation.build(points);
  triangulation.start_journal();
  const std::size_t side = kSmall ? 3 : 37;  // of a square that contains sets of 12 x 12 cells
  std::vector<std::vector<tri::VertexId>> all(side * side);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto column = static_cast<std::size_t>(points[i][0] / 12);
    const auto row = static_cast<std::size_t>(points[i][1] / 12);
    if (column < side && row < side) all[row * side + column].push_back(built[i]);
  }
  std::size_t count = 0;
  for (const auto& set : all) count += 2 * set.size();
  typename Triangulation::Changes changes;
  measure(state, count, [&] {
    const double start = cpu_seconds();
    for (auto& set : all) {
      std::vector<Point> places;
      for (const tri::VertexId v : set) places.push_back(triangulation.point(v));
      triangulation.remove(set);
      triangulation.take_changes(changes);
      std::vector<typename Triangulation::Insertion> inserted(set.size());
      triangulation.insert(places, inserted);
      triangulation.take_changes(changes);
      for (std::size_t i = 0; i < set.size(); ++i) set[i] = inserted[i].vertex;
    }
    return cpu_seconds() - start;
  });
}
void plain_sets(benchmark::State& state) { sets(state, tri::Delaunay2<double>()); }
void sets_in_regions(benchmark::State& state) {
  sets(state, tri::RegionalDelaunay2<double>(three_regions(static_cast<double>(state.range(1)))));
}

void once(benchmark::internal::Benchmark* row) {
  row->UseManualTime()->Iterations(1)->Unit(benchmark::kMillisecond);
}
void metrics(benchmark::internal::Benchmark* row) {
  once(row);
  row->ArgNames({"grid", "metric"})->ArgsProduct({{kUniform, kGrid}, {kUpright, kSlanted, kFlat}});
}

BENCHMARK(euclidean)->Apply(once)->ArgName("grid")->Arg(kUniform)->Arg(kGrid);
BENCHMARK(elliptical)->Apply(once)->ArgNames({"grid", "metric"})->Args({kUniform, kRound});
BENCHMARK(elliptical)->Apply(once)->ArgNames({"grid", "metric"})->Args({kGrid, kRound});
BENCHMARK(elliptical)->Apply(metrics);
BENCHMARK(cgal_mapped)->Apply(metrics);
BENCHMARK(regions)
    ->Apply(once)
    ->ArgNames({"grid", "ratio"})
    ->ArgsProduct({{kUniform, kGrid}, {3, 10, 100}});
BENCHMARK(plain_sets)->Apply(once)->ArgName("grid")->Arg(kUniform)->Arg(kGrid);
BENCHMARK(sets_in_regions)
    ->Apply(once)
    ->ArgNames({"grid", "ratio"})
    ->ArgsProduct({{kUniform, kGrid}, {3, 10, 100}});

}  // namespace

BENCHMARK_MAIN();
