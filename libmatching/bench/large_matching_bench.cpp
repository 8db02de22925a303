// SPDX-License-Identifier: Apache-2.0
// Matches large sets and reports the time, the proven gap, and the excess over the exact optimum
// within random windows of 10,000 points (the 5,000 pairs nearest to a place).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <vector>

#include <benchmark/benchmark.h>

#include "terrace/matching/large_matching.hpp"

namespace {

using namespace terrace::matching;

bool small() { return std::getenv("TERRACE_BENCH_SMALL") != nullptr; }

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

/// Makes points that are uniform or in clumps whose density falls off outward.
template <std::size_t D>
std::vector<std::array<double, D>> make_points(std::size_t n, bool clumps) {
  std::mt19937_64 random(1);
  std::vector<std::array<double, D>> centres(50), points(n);
  for (auto& p : centres) {
    for (double& c : p) c = uniform(random);
  }
  for (auto& p : points) {
    const auto& centre = centres[random() % centres.size()];
    for (std::size_t d = 0; d < D; ++d) {
      p[d] = clumps ? centre[d] + 0.02 * std::tan(3.0 * (uniform(random) - 0.5)) : uniform(random);
    }
  }
  return points;
}

template <std::size_t D>
double distance(const std::array<double, D>& p, const std::array<double, D>& q) {
  double sum = 0.0;
  for (std::size_t d = 0; d < D; ++d) sum += (p[d] - q[d]) * (p[d] - q[d]);
  return std::sqrt(sum);
}

/// Returns the excess over the optimum in each window, as a fraction.
template <std::size_t D>
std::vector<double> above_in_windows(const std::vector<std::array<double, D>>& points,
                                     const LargeMatching& matching, std::size_t pairs) {
  std::vector<std::uint32_t> heads;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (matching.mate[i] != kNone && i < matching.mate[i]) heads.push_back(i);
  }
  pairs = std::min(pairs, heads.size());
  std::vector<double> above;
  std::mt19937_64 random(2);
  for (int window = 0; window < 20; ++window) {
    const auto& place = points[random() % points.size()];
    std::nth_element(heads.begin(), heads.begin() + static_cast<std::ptrdiff_t>(pairs - 1),
                     heads.end(), [&](std::uint32_t a, std::uint32_t b) {
                       return distance(points[a], place) < distance(points[b], place);
                     });
    std::vector<std::array<double, D>> inside;
    double cost = 0.0;
    for (std::size_t k = 0; k < pairs; ++k) {
      const std::uint32_t i = heads[k], j = matching.mate[i];
      inside.push_back(points[i]);
      inside.push_back(points[j]);
      cost += distance(points[i], points[j]);
    }
    above.push_back(cost / match_points(inside).cost - 1.0);
  }
  return above;
}

template <std::size_t D>
void match_in_windows(benchmark::State& state) {
  const auto points = make_points<D>(static_cast<std::size_t>(state.range(0)), state.range(1) != 0);
  LargeMatchingOptions options;
  options.exact_limit = 0;
  options.threads = 0;
  if (small()) options.window = 2000;
  LargeMatching matching;
  for (auto _ : state) matching = match_large(points, options);
  const std::vector<double> above = above_in_windows(points, matching, small() ? 500 : 5000);
  double sum = 0.0;
  for (const double share : above) sum += share;
  state.counters["gap_percent"] = 100.0 * matching.gap();
  state.counters["windows_above_percent"] = 100.0 * sum / static_cast<double>(above.size());
  state.counters["worst_window_percent"] = 100.0 * *std::max_element(above.begin(), above.end());
  state.counters["rounds"] = matching.rounds;
}

template <std::size_t D>
void match_exactly(benchmark::State& state) {
  const auto points = make_points<D>(static_cast<std::size_t>(state.range(0)), state.range(1) != 0);
  for (auto _ : state) benchmark::DoNotOptimize(match_points(points).cost);
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  for (const int clumps : {0, 1}) {
    for (const int n : small() ? std::vector<int>{10000} : std::vector<int>{1000000, 5000000}) {
      benchmark->Args({n, clumps});
    }
  }
  benchmark->ArgNames({"n", "clumps"})->Unit(benchmark::kSecond)->UseRealTime()->Iterations(1);
}

void exact_sizes(benchmark::internal::Benchmark* benchmark) {
  for (const int clumps : {0, 1}) benchmark->Args({small() ? 10000 : 1000000, clumps});
  benchmark->ArgNames({"n", "clumps"})->Unit(benchmark::kSecond)->UseRealTime()->Iterations(1);
}

BENCHMARK(match_in_windows<2>)->Apply(sizes);
BENCHMARK(match_in_windows<3>)->Apply(sizes);
BENCHMARK(match_exactly<2>)->Apply(exact_sizes);
BENCHMARK(match_exactly<3>)->Apply(exact_sizes);

}  // namespace

BENCHMARK_MAIN();
