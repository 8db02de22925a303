// SPDX-License-Identifier: Apache-2.0
// Assignment between two sets of uniform points in the unit square, Euclidean costs.
//
// matching_assignment_bench --peer MATRIX N prints three times in seconds and the cost for a file
// of N * N doubles: what assignment_peers.py compares with.
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

namespace {

std::vector<double> euclidean_costs(std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<double> x(2 * n), y(2 * n), costs(n * n);
  for (std::size_t i = 0; i < 2 * n; ++i) {
    x[i] = uniform();
    y[i] = uniform();
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j)
      costs[i * n + j] = std::hypot(x[i] - x[n + j], y[i] - y[n + j]);
  }
  return costs;
}

void assign_uniform(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  const std::vector<double> costs = euclidean_costs(n, 1);
  double cost = 0;
  for (auto _ : state) {
    cost = terrace::matching::assign(costs, n, n).cost;
    benchmark::DoNotOptimize(cost);
  }
  state.counters["cost"] = cost;
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  const bool small = std::getenv("TERRACE_BENCH_SMALL") != nullptr;
  for (const int n : small ? std::vector<int>{50} : std::vector<int>{500, 1000, 2000})
    benchmark->Arg(n);
}
BENCHMARK(assign_uniform)->Apply(sizes)->Unit(benchmark::kMillisecond);

template <class Solve>
void print_times(const Solve& solve) {
  double cost = 0;
  for (int round = 0; round < 3; ++round) {
    const auto start = std::chrono::steady_clock::now();
    cost = solve();
    std::printf("%.6f ",
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::printf("%.17g\n", cost);
}

int peer(const char* matrix, std::size_t n) {
  std::vector<double> costs(n * n);
  std::ifstream file(matrix, std::ios::binary);
  file.read(reinterpret_cast<char*>(costs.data()),
            static_cast<std::streamsize>(costs.size() * sizeof(double)));
  if (!file) return 1;
  print_times([&] { return terrace::matching::assign(costs, n, n).cost; });
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
