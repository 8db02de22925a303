// SPDX-License-Identifier: Apache-2.0
// Assigns two sets of uniform points in the unit square to each other at Euclidean costs.
//
// matching_assignment_bench --peer POINTS N reads a file of 2 N points (4 N doubles) and prints,
// for each method, three times in seconds and the cost, for assignment_peers.py.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <string_view>
#include <vector>

#include <benchmark/benchmark.h>

#include "terrace/matching/assignment.hpp"
#include "terrace/matching/point_assignment.hpp"
#include "terrace/matching/sparse_assignment.hpp"

namespace {

using terrace::matching::Point2;

std::vector<Point2> uniform_points(std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Point2> points(n);
  for (Point2& p : points) {
    for (double& x : p) x = static_cast<double>(random() >> 11) * 0x1p-53;
  }
  return points;
}

std::vector<double> euclidean_costs(std::span<const Point2> rows, std::span<const Point2> columns) {
  std::vector<double> costs;
  costs.reserve(rows.size() * columns.size());
  for (const Point2& r : rows) {
    for (const Point2& c : columns)
      costs.push_back(std::sqrt((r[0] - c[0]) * (r[0] - c[0]) + (r[1] - c[1]) * (r[1] - c[1])));
  }
  return costs;
}

/// The k smallest entries of each row.
struct Candidates {
  std::size_t columns;
  std::vector<std::size_t> begin{0};
  std::vector<std::uint32_t> column;
  std::vector<double> cost;

  Candidates(const std::vector<double>& costs, std::size_t n, std::size_t k) : columns(n) {
    std::vector<std::uint32_t> order(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double* row = costs.data() + i * n;
      for (std::uint32_t j = 0; j < n; ++j) order[j] = j;
      std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(k), order.end(),
                        [&](std::uint32_t a, std::uint32_t b) {
                          return row[a] != row[b] ? row[a] < row[b] : a < b;
                        });
      for (std::size_t c = 0; c < k; ++c) {
        column.push_back(order[c]);
        cost.push_back(row[order[c]]);
      }
      begin.push_back(column.size());
    }
  }
  terrace::matching::SparseCosts costs() const { return {columns, begin, column, cost}; }
};

constexpr std::size_t kCandidates = 40;

void assign_matrix(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  const std::vector<double> costs = euclidean_costs(uniform_points(n, 1), uniform_points(n, 2));
  double cost = 0;
  for (auto _ : state) cost = terrace::matching::assign(costs, n, n).cost;
  state.counters["cost"] = cost;
}

void assign_candidates(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  const Candidates candidates(euclidean_costs(uniform_points(n, 1), uniform_points(n, 2)), n,
                              std::min(n, kCandidates));
  double cost = 0;
  for (auto _ : state) cost = terrace::matching::assign_sparse(candidates.costs()).cost;
  state.counters["cost"] = cost;
}

void assign_near_points(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  const std::vector<Point2> rows = uniform_points(n, 1), columns = uniform_points(n, 2);
  double cost = 0;
  for (auto _ : state) cost = terrace::matching::assign_points(rows, columns).cost;
  state.counters["cost"] = cost;
}

void sizes(benchmark::internal::Benchmark* benchmark, const std::vector<int>& large) {
  const bool small = std::getenv("TERRACE_BENCH_SMALL") != nullptr;
  for (const int n : small ? std::vector<int>{50} : large) benchmark->Arg(n);
  benchmark->Unit(benchmark::kMillisecond);
}
void dense_sizes(benchmark::internal::Benchmark* b) { sizes(b, {500, 1000, 2000, 4000}); }
void point_sizes(benchmark::internal::Benchmark* b) { sizes(b, {500, 1000, 2000, 4000, 20000}); }
BENCHMARK(assign_matrix)->Apply(dense_sizes);
BENCHMARK(assign_candidates)->Apply(dense_sizes);
BENCHMARK(assign_near_points)->Apply(point_sizes);

template <class Solve>
void print_times(const char* name, const Solve& solve) {
  double cost = 0;
  std::printf("%s ", name);
  for (int round = 0; round < 3; ++round) {
    const auto start = std::chrono::steady_clock::now();
    cost = solve();
    std::printf("%.6f ",
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::printf("%.17g\n", cost);
}

int peer(const char* name, std::size_t n) {
  std::vector<Point2> points(2 * n);
  std::ifstream file(name, std::ios::binary);
  file.read(reinterpret_cast<char*>(points.data()),
            static_cast<std::streamsize>(points.size() * sizeof(Point2)));
  if (!file) return 1;
  const auto rows = std::span<const Point2>(points).first(n);
  const auto columns = std::span<const Point2>(points).last(n);
  const std::vector<double> costs = euclidean_costs(rows, columns);
  const std::vector<float> floats(costs.begin(), costs.end());
  const Candidates candidates(costs, n, std::min(n, kCandidates));
  print_times("matrix", [&] { return terrace::matching::assign(costs, n, n).cost; });
  print_times("floats", [&] { return terrace::matching::assign(floats, n, n).cost; });
  print_times("candidates",
              [&] { return terrace::matching::assign_sparse(candidates.costs()).cost; });
  print_times("points", [&] { return terrace::matching::assign_points(rows, columns).cost; });
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 4 && std::string_view(argv[1]) == "--peer") {
    return peer(argv[2], std::strtoul(argv[3], nullptr, 10));
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
