// SPDX-License-Identifier: GPL-3.0-or-later
// Measures heights at 1,000,000 random queries in one call on 1,000,000 points, on one thread.
// Compares with CGAL's natural_neighbor_coordinates_2 with EPICK on the same points and queries
// (sorted along a Hilbert curve, each search starting where the last one ended). Uniform: points of
// 26 bits. Grid: 1000 x 1000, where every cell is cocircular.
//
// items_per_second counts queries per second of CPU time. Ours includes all work of a call, such as
// sorting. CGAL's excludes sorting.
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/hilbert_sort.h>
#include <CGAL/natural_neighbor_coordinates_2.h>
#include <benchmark/benchmark.h>

#include "terrace/tri/interpolation.hpp"

namespace {

using terrace::tri::Delaunay2;
using terrace::tri::GradientFrom;
using terrace::tri::Interpolation;
using terrace::tri::Point2;
using terrace::tri::VertexId;

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;
const std::uint32_t kSide = kSmall ? 50 : 1000;
const std::size_t kQueries = kSmall ? 2500 : 1'000'000;

enum Input { kUniform, kGrid };

std::vector<std::array<std::int32_t, 2>> input_points(Input input) {
  const auto step = static_cast<std::int32_t>((1 << 26) / kSide);
  std::mt19937_64 random(1);
  std::vector<std::array<std::int32_t, 2>> points;
  for (std::uint32_t j = 0; j < kSide; ++j) {
    for (std::uint32_t i = 0; i < kSide; ++i) {
      if (input == kGrid) {
        points.push_back(
            {static_cast<std::int32_t>(i) * step, static_cast<std::int32_t>(j) * step});
      } else {
        points.push_back(
            {static_cast<std::int32_t>(random() >> 38), static_cast<std::int32_t>(random() >> 38)});
      }
    }
  }
  return points;
}

double height_of(double x, double y) { return 300 + x * y * 0x1p-46 - y * 0x1p-20; }

std::vector<Point2> input_queries() {
  std::mt19937_64 random(2);
  std::vector<Point2> queries(kQueries);
  for (Point2& p : queries)
    for (double& c : p) c = static_cast<double>(random() >> 11) * 0x1p-27;
  return queries;
}

template <class Coord>
struct Surface {
  explicit Surface(Input input) {
    std::vector<std::array<Coord, 2>> points;
    for (const auto& [x, y] : input_points(input))
      points.push_back({static_cast<Coord>(x), static_cast<Coord>(y)});
    triangulation.build(points);
    heights.resize(triangulation.vertex_slots());
    for (const VertexId v : triangulation.all_vertices()) {
      const auto p = triangulation.point(v);
      heights[slot(v)] = height_of(static_cast<double>(p[0]), static_cast<double>(p[1]));
    }
  }
  Delaunay2<Coord> triangulation;
  std::vector<double> heights;
};

void count(benchmark::State& state, std::size_t queries) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(queries));
}

template <class Coord>
void heights(benchmark::State& state, Input input, Interpolation method) {
  const Surface<Coord> surface(input);
  const auto queries = input_queries();
  for (auto _ : state)
    benchmark::DoNotOptimize(
        heights_at(surface.triangulation, surface.heights, queries, method, 1));
  count(state, queries.size());
}

template <class Coord>
void gradients(benchmark::State& state, Input input, GradientFrom from) {
  const Surface<Coord> surface(input);
  const auto queries = input_queries();
  for (auto _ : state)
    benchmark::DoNotOptimize(
        gradients_at(surface.triangulation, surface.heights, queries, from, 1));
  count(state, queries.size());
}

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Vertex = CGAL::Triangulation_vertex_base_with_info_2<double, Kernel>;
using Peer = CGAL::Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<Vertex>>;

void peer(benchmark::State& state, Input input) {
  Peer triangulation;
  std::vector<Kernel::Point_2> points;
  for (const auto& [x, y] : input_points(input)) points.emplace_back(x, y);
  triangulation.insert(points.begin(), points.end());
  for (const auto& v : triangulation.finite_vertex_handles())
    v->info() = height_of(v->point().x(), v->point().y());

  std::vector<Kernel::Point_2> queries;
  for (const Point2& p : input_queries()) queries.emplace_back(p[0], p[1]);
  CGAL::hilbert_sort(queries.begin(), queries.end());  // not timed
  for (auto _ : state) {
    std::vector<double> result;
    using Weight = std::pair<Peer::Vertex_handle, double>;
    std::vector<Weight> weights;
    Peer::Face_handle start;
    for (std::size_t i = 0; i < kQueries; ++i) {
      weights.clear();
      const auto found = CGAL::natural_neighbor_coordinates_2(
          triangulation, queries[i], std::back_inserter(weights), CGAL::Identity<Weight>(), start);
      double sum = 0;
      for (const auto& [vertex, weight] : weights) sum += vertex->info() * weight / found.second;
      result.push_back(sum);
      if (!weights.empty()) start = weights[0].first->face();
    }
    benchmark::DoNotOptimize(result.data());
  }
  count(state, kQueries);
}

template <class Coord>
void add(Input input, const std::string& name) {
  const auto row = [&](const char* what, auto function, auto method) {
    benchmark::RegisterBenchmark((std::string(what) + "/" + name).c_str(), function, input, method)
        ->Unit(benchmark::kMillisecond);
  };
  row("natural_neighbour", heights<Coord>, Interpolation::natural_neighbour);
  row("linear", heights<Coord>, Interpolation::linear);
  row("nearest", heights<Coord>, Interpolation::nearest);
  row("gradient_natural", gradients<Coord>, GradientFrom::natural_neighbours);
  row("gradient_triangles", gradients<Coord>, GradientFrom::triangles);
}

}  // namespace

int main(int argc, char** argv) {
  add<std::int32_t>(kUniform, "uniform/integers");
  add<double>(kUniform, "uniform/doubles");
  add<std::int32_t>(kGrid, "grid/integers");
  add<double>(kGrid, "grid/doubles");
  benchmark::RegisterBenchmark("natural_neighbour/uniform/CGAL", peer, kUniform)
      ->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("natural_neighbour/grid/CGAL", peer, kGrid)
      ->Unit(benchmark::kMillisecond);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
