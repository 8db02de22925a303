// SPDX-License-Identifier: Apache-2.0
// Compares exact Euclidean matching of uniform points with LEMON's blossom algorithm on the
// complete graph (building its graph is not timed). Also matches TSPLIB sets if TERRACE_DATA names
// the data folder.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "../tests/tsplib.hpp"
#include "terrace/matching/point_matching.hpp"
#ifdef TERRACE_HAS_LEMON
#include "../tests/lemon_oracle.hpp"
#endif

namespace {

using terrace::matching::match_points;
using terrace::matching::Point2;
using terrace::matching::Point3;
using terrace::matching::PointMatching;
using terrace::matching::PointMatchingOptions;
namespace tsplib = terrace::matching::tsplib;

template <std::size_t D>
std::vector<std::array<double, D>> uniform_points(std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<std::array<double, D>> points(n);
  for (auto& p : points) {
    for (double& c : p) c = static_cast<double>(random() >> 11) * 0x1p-53;
  }
  return points;
}

void report(benchmark::State& state, const PointMatching& m) {
  state.counters["cost"] = m.cost;
  state.counters["gap"] = m.cost - m.dual_bound;
  state.counters["rounds"] = static_cast<double>(m.rounds);
  state.counters["edges"] = static_cast<double>(m.edges);
}

template <std::size_t D>
void match_uniform(benchmark::State& state) {
  const auto points = uniform_points<D>(static_cast<std::size_t>(state.range(0)), 1);
  PointMatching m;
  for (auto _ : state) m = match_points(points);
  report(state, m);
}

#ifdef TERRACE_HAS_LEMON
// Weights are distances times 10^7, rounded.
void lemon_complete_graph(benchmark::State& state) {
  const auto points = uniform_points<2>(static_cast<std::size_t>(state.range(0)), 1);
  std::vector<LemonOracle::Edge> edges;
  const auto n = static_cast<std::uint32_t>(points.size());
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = i + 1; j < n; ++j) {
      const double d = std::hypot(points[i][0] - points[j][0], points[i][1] - points[j][1]);
      edges.push_back({i, j, std::llround(d * 1e7)});
    }
  }
  LemonOracle lemon(n, edges);
  std::int64_t cost = 0;
  for (auto _ : state) benchmark::DoNotOptimize(lemon.solve(cost));
  state.counters["cost"] = static_cast<double>(cost) * 1e-7;
}
#endif

// The largest sets are compressed. gzip reads plain files too.
std::string unpacked(const std::string& path) {
  std::FILE* pipe = popen(("gzip -dcf '" + path + "'").c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("cannot run gzip");
  std::string text;
  std::vector<char> block(1 << 16);
  std::size_t got = 0;
  while ((got = std::fread(block.data(), 1, block.size(), pipe)) != 0)
    text.append(block.data(), got);
  if (pclose(pipe) != 0) throw std::runtime_error("cannot read " + path);
  return text;
}

void match_tsplib(benchmark::State& state, const std::string& path, double optimum) {
  std::istringstream text(unpacked(path));
  const tsplib::Instance instance = tsplib::read(text);
  PointMatchingOptions options;
  options.metric = tsplib::metric_of(instance);
  PointMatching m;
  for (auto _ : state) m = match_points(instance.points, options);
  report(state, m);
  state.counters["above_optimum"] = m.cost - optimum;
}

bool small() { return std::getenv("TERRACE_BENCH_SMALL") != nullptr; }

void sizes(benchmark::internal::Benchmark* benchmark) {
  for (const int n :
       small() ? std::vector<int>{200} : std::vector<int>{500, 1000, 2000, 10000, 100000}) {
    benchmark->Arg(n);
  }
}
BENCHMARK(match_uniform<2>)->Apply(sizes)->Unit(benchmark::kMillisecond);
BENCHMARK(match_uniform<3>)->Apply(sizes)->Unit(benchmark::kMillisecond);

#ifdef TERRACE_HAS_LEMON
void lemon_sizes(benchmark::internal::Benchmark* benchmark) {
  for (const int n : small() ? std::vector<int>{200} : std::vector<int>{500, 1000, 2000}) {
    benchmark->Arg(n);
  }
}
BENCHMARK(lemon_complete_graph)->Apply(lemon_sizes)->Unit(benchmark::kMillisecond);
#endif

void register_tsplib(const std::string& data) {
  const std::string folder = data + "/matching/";
  std::ifstream list(folder + "mwpm_optima.tsv");
  for (const auto& [name, optimum] : tsplib::read_optima(list)) {
    std::string path = folder + "tsplib/" + name + ".tsp";
    if (!std::ifstream(path)) path += ".gz";
    benchmark::RegisterBenchmark(("match_tsplib/" + name).c_str(), match_tsplib, path, optimum)
        ->Unit(benchmark::kMillisecond);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const char* data = std::getenv("TERRACE_DATA");
  if (data != nullptr && !small()) register_tsplib(data);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
