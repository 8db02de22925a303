// SPDX-License-Identifier: Apache-2.0
// Dense assignment between two sets of uniform points in the unit square, Euclidean costs.
#include <cmath>
#include <cstdlib>
#include <random>
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

}  // namespace

BENCHMARK_MAIN();
