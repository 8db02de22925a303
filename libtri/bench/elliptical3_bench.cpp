// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the elliptical tetrahedralisation with the Euclidean one of doubles, and with CGAL's
// Delaunay_triangulation_3 with EPICK on points that were mapped and rounded, in one run on the
// same points: 100,000 uniform ones, or the complete grid of 46^3, in random order. Metrics: a
// sphere; axes of 5, 1, 2 along those of the coordinates, and rotated; 100, 1, 1 rotated. Also
// measures the removal of 200 compact sets of 100 of the uniform points, their insertion with
// hints, and flips to three regions.
//
// items_per_second counts points; CPU time, median of 5 rounds.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <random>
#include <vector>

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <benchmark/benchmark.h>

#include "terrace/tri/metric.hpp"

namespace {

namespace tri = terrace::tri;
using Point = std::array<double, 3>;

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;
const std::uint32_t kSide = kSmall ? 10 : 46;
const std::size_t kCount = kSmall ? 1000 : 100'000;
const std::size_t kSets = kSmall ? 4 : 200;
const std::size_t kSetSize = kSmall ? 10 : 100;

enum Input { kUniform, kGrid };
enum Metric { kRound, kUpright, kTurned, kThin };

std::vector<Point> input_points(Input input) {
  std::mt19937_64 random(1);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<Point> points;
  if (input == kGrid) {
    for (std::uint32_t i = 0; i < kSide * kSide * kSide; ++i)
      points.push_back({static_cast<double>(i % kSide), static_cast<double>(i / kSide % kSide),
                        static_cast<double>(i / kSide / kSide)});
  }
  while (points.size() < kCount && input == kUniform) points.push_back({unit(), unit(), unit()});
  std::shuffle(points.begin(), points.end(), random);
  return points;
}

tri::LinearMap3 map_of(Metric metric) {
  const tri::LinearMap3 axes{2.0 / 7,  3.0 / 7,  6.0 / 7, 6.0 / 7, 2.0 / 7,
                             -3.0 / 7, -3.0 / 7, 6.0 / 7, -2.0 / 7};
  switch (metric) {
    case kRound:
      return tri::kIdentityMap<3>;
    case kUpright:
      return tri::ellipsoid_map({5, 1, 2});
    case kTurned:
      return tri::ellipsoid_map({5, 1, 2}, axes);
    default:
      return tri::ellipsoid_map({100, 1, 1}, axes);
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
    tri::Delaunay3<double> triangulation;
    const double start = cpu_seconds();
    triangulation.build(points);
    return cpu_seconds() - start;
  });
}

void elliptical(benchmark::State& state) {
  const auto points = input_points(static_cast<Input>(state.range(0)));
  measure(state, points.size(), [&] {
    tri::Delaunay3<double, tri::EllipticalMetric3> triangulation(
        map_of(static_cast<Metric>(state.range(1))));
    const double start = cpu_seconds();
    triangulation.build(points);
    return cpu_seconds() - start;
  });
}

void cgal_mapped(benchmark::State& state) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  const auto points = input_points(static_cast<Input>(state.range(0)));
  const tri::LinearMap3 m = map_of(static_cast<Metric>(state.range(1)));
  measure(state, points.size(), [&] {
    const double start = cpu_seconds();
    std::vector<Kernel::Point_3> mapped;
    mapped.reserve(points.size());
    for (const auto& [x, y, z] : points)
      mapped.emplace_back(m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z,
                          m[6] * x + m[7] * y + m[8] * z);
    const CGAL::Delaunay_triangulation_3<Kernel> triangulation(mapped.begin(), mapped.end());
    return cpu_seconds() - start;
  });
}

/// Disjoint sets of points close to each other in the metric.
template <class Triangulation>
std::vector<std::vector<tri::VertexId>> compact_sets(const Triangulation& triangulation) {
  std::mt19937_64 random(2);
  std::vector<char> taken(triangulation.vertex_slots());
  std::vector<std::vector<tri::VertexId>> sets;
  std::vector<tri::VertexId> neighbours;
  while (sets.size() < kSets) {
    const tri::VertexId start{
        static_cast<std::uint32_t>(1 + random() % (triangulation.vertex_slots() - 1))};
    std::vector<tri::VertexId> found{start};
    std::vector<char> seen = taken;
    if (taken[slot(start)] != 0) continue;
    seen[slot(start)] = 1;
    for (std::size_t k = 0; k < found.size() && found.size() < kSetSize; ++k) {
      triangulation.adjacent(found[k], neighbours);
      for (const tri::VertexId v : neighbours) {
        if (found.size() == kSetSize || seen[slot(v)] != 0) continue;
        seen[slot(v)] = 1;
        found.push_back(v);
      }
    }
    if (found.size() < kSetSize) continue;
    for (const tri::VertexId v : found) taken[slot(v)] = 1;
    sets.push_back(std::move(found));
  }
  return sets;
}

template <class Triangulation>
void change_sets(benchmark::State& state, Triangulation triangulation, bool inserting) {
  triangulation.build(input_points(kUniform));
  auto sets = compact_sets(triangulation);
  std::vector<tri::VertexId> hints, neighbours;
  for (auto& set : sets) {
    std::sort(set.begin(), set.end());
    hints.push_back(tri::kNoVertex);
    for (const tri::VertexId v : set) {
      triangulation.adjacent(v, neighbours);
      for (const tri::VertexId n : neighbours)
        if (!std::binary_search(set.begin(), set.end(), n)) hints.back() = n;
    }
  }
  std::vector<Point> points;
  std::vector<typename Triangulation::Insertion> results(kSetSize);
  measure(state, kSets * kSetSize, [&] {
    double seconds = 0;
    for (std::size_t s = 0; s < sets.size(); ++s) {
      points.clear();
      for (const tri::VertexId v : sets[s]) points.push_back(triangulation.point(v));
      const double start = cpu_seconds();
      triangulation.remove(std::span<const tri::VertexId>(sets[s]));
      const double middle = cpu_seconds();
      const tri::VertexId hint = triangulation.alive(hints[s]) ? hints[s] : tri::kNoVertex;
      triangulation.insert(points, results, hint);
      seconds += inserting ? cpu_seconds() - middle : middle - start;
      for (std::size_t i = 0; i < results.size(); ++i) sets[s][i] = results[i].vertex;
    }
    return seconds;
  });
}

void euclidean_sets(benchmark::State& state) {
  change_sets(state, tri::Delaunay3<double>(), state.range(0) != 0);
}
void elliptical_sets(benchmark::State& state) {
  change_sets(
      state,
      tri::Delaunay3<double, tri::EllipticalMetric3>(map_of(static_cast<Metric>(state.range(1)))),
      state.range(0) != 0);
}

/// Three boxes that cover most of the cube, with ellipsoids of the given ratio. Also counts the
/// facets that remain non-Delaunay. There are about twice as many facets within regions as
/// tetrahedra.
void regions(benchmark::State& state) {
  const auto points = input_points(static_cast<Input>(state.range(0)));
  const auto ratio = static_cast<double>(state.range(1));
  const double side = state.range(0) == kGrid ? kSide : 1;
  const tri::LinearMap3 axes{2.0 / 7,  3.0 / 7,  6.0 / 7, 6.0 / 7, 2.0 / 7,
                             -3.0 / 7, -3.0 / 7, 6.0 / 7, -2.0 / 7};
  const tri::MetricField3 field(
      {{{{0, 0, 0}, {0.5 * side, 0.6 * side, side}}, tri::ellipsoid_map({ratio, 1, 1}, axes)},
       {{{0.5 * side, 0, 0}, {side, 0.6 * side, side}}, tri::ellipsoid_map({1, 1, ratio})},
       {{{0, 0.7 * side, 0}, {side, side, side}}, tri::ellipsoid_map({ratio, ratio, 1}, axes)}});
  tri::Delaunay3<double> triangulation;
  triangulation.build(points);
  measure(state, points.size(), [&] {
    const double start = cpu_seconds();
    const tri::MetricTetrahedra result = tri::metric_tetrahedra(triangulation, field);
    const double seconds = cpu_seconds() - start;
    state.counters["tetrahedra"] = static_cast<double>(result.tetrahedra.size());
    state.counters["flips"] = static_cast<double>(result.flips);
    state.counters["stuck"] = static_cast<double>(result.stuck);
    return seconds;
  });
}

void once(benchmark::internal::Benchmark* row) {
  row->UseManualTime()->Iterations(1)->Unit(benchmark::kMillisecond);
}

BENCHMARK(euclidean)->Apply(once)->ArgName("grid")->Arg(kUniform)->Arg(kGrid);
BENCHMARK(elliptical)
    ->Apply(once)
    ->ArgNames({"grid", "metric"})
    ->ArgsProduct({{kUniform, kGrid}, {kRound, kUpright, kTurned, kThin}});
BENCHMARK(cgal_mapped)
    ->Apply(once)
    ->ArgNames({"grid", "metric"})
    ->ArgsProduct({{kUniform, kGrid}, {kUpright, kTurned, kThin}});
BENCHMARK(euclidean_sets)->Apply(once)->ArgName("insert")->Arg(0)->Arg(1);
BENCHMARK(elliptical_sets)
    ->Apply(once)
    ->ArgNames({"insert", "metric"})
    ->ArgsProduct({{0, 1}, {kRound, kTurned, kThin}});
BENCHMARK(regions)
    ->Apply(once)
    ->ArgNames({"grid", "ratio"})
    ->ArgsProduct({{kUniform, kGrid}, {2, 5, 20}});

}  // namespace

BENCHMARK_MAIN();
