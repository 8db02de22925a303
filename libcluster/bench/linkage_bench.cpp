// SPDX-License-Identifier: Apache-2.0
// Measures the wall time of linkage of points uniform in a cube: single linkage of 10,000, 100,000
// and 1,000,000 points (TERRACE_BENCH_SMALL: 500), on one thread and two. Also runs on inputs with
// ties and duplicates. linkage_peers.py compares it with fastcluster.
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>

#include <benchmark/benchmark.h>

#include "../tests/inputs.hpp"
#include "terrace/cluster/linkage.hpp"

namespace {

using namespace terrace::cluster;

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;

enum class Input { cube, grid, clumps };

std::vector<Point3> make_points(Input input, std::size_t count) {
  std::mt19937_64 random(20);
  std::vector<Point3> points = inputs::cube(count, random);
  const double side = std::cbrt(static_cast<double>(count));
  for (Point3& p : points) {
    for (double& v : p) {
      if (input == Input::grid) v = std::floor(v * side);
      if (input == Input::clumps) v = std::floor(v * 4) + 0.1 * v * inputs::uniform(random);
    }
  }
  return points;
}

/// Returns a value of /proc/self/status, which is in kilobytes, in mebibytes; 0 if it is missing.
double status_mebibytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(key + ":", 0) == 0) return std::stod(line.substr(key.size() + 1)) / 1024;
  }
  return 0.0;
}

void complete(benchmark::State& state, Input input, MatrixEntry entry) {
  const auto count = static_cast<std::size_t>(state.range(0));
  const std::vector<Point3> points = make_points(input, count);
  const LinkageOptions options{.threads = static_cast<unsigned>(state.range(1)), .entry = entry};
  const double before = status_mebibytes("VmRSS");
  for ([[maybe_unused]] const auto iteration : state) {
    const Dendrogram dendrogram = complete_linkage(points, options);
    benchmark::DoNotOptimize(dendrogram.merges.data());
  }
  // The peak of the whole process so far, so it belongs to this benchmark only if it runs first.
  state.counters["peak_MiB"] = status_mebibytes("VmHWM") - before;
}

void by_method(benchmark::State& state, Input input, LinkageMethod method) {
  const std::vector<Point3> points = make_points(input, static_cast<std::size_t>(state.range(0)));
  const LinkageOptions options{.threads = static_cast<unsigned>(state.range(1))};
  for ([[maybe_unused]] const auto iteration : state) {
    const Dendrogram dendrogram = linkage(points, method, options);
    benchmark::DoNotOptimize(dendrogram.merges.data());
  }
}

void complete_function(benchmark::State& state, bool row) {
  const auto count = static_cast<std::size_t>(state.range(0));
  const std::vector<Point3> points = make_points(Input::cube, count);
  const PairDistance distance = [&](std::uint32_t i, std::uint32_t j) -> double {
    if (row) return j;
    const Point3& p = points[i];
    const Point3& q = points[j];
    return std::sqrt((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) +
                     (p[2] - q[2]) * (p[2] - q[2]));
  };
  const LinkageOptions options{.threads = static_cast<unsigned>(state.range(1)),
                               .entry = MatrixEntry::float32};
  for ([[maybe_unused]] const auto iteration : state) {
    const Dendrogram dendrogram = complete_linkage(count, distance, options);
    benchmark::DoNotOptimize(dendrogram.merges.data());
  }
}

void single(benchmark::State& state, Input input) {
  const auto count = static_cast<std::size_t>(state.range(0));
  const std::vector<Point3> points = make_points(input, count);
  const LinkageOptions options{.threads = static_cast<unsigned>(state.range(1))};
  for ([[maybe_unused]] const auto iteration : state) {
    const Dendrogram dendrogram = single_linkage(points, options);
    benchmark::DoNotOptimize(dendrogram.merges.data());
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

void sizes(benchmark::internal::Benchmark* benchmark, const std::vector<std::int64_t>& counts) {
  benchmark->UseRealTime()->Unit(benchmark::kMillisecond);
  for (const std::int64_t count : kSmall ? std::vector<std::int64_t>{500} : counts) {
    for (const std::int64_t threads : {1, 2}) benchmark->Args({count, threads});
  }
}

}  // namespace

int main(int argc, char** argv) {
  sizes(benchmark::RegisterBenchmark("single/cube", single, Input::cube), {10000, 100000, 1000000});
  sizes(benchmark::RegisterBenchmark("single/grid", single, Input::grid), {100000, 1000000});
  sizes(benchmark::RegisterBenchmark("single/clumps", single, Input::clumps), {100000, 1000000});
  for (const auto& [name, input] :
       {std::pair{"cube", Input::cube}, {"grid", Input::grid}, {"clumps", Input::clumps}}) {
    const std::string text = name;
    sizes(benchmark::RegisterBenchmark(("complete/float/" + text).c_str(), complete, input,
                                       MatrixEntry::float32),
          {10000});
    sizes(benchmark::RegisterBenchmark(("complete/double/" + text).c_str(), complete, input,
                                       MatrixEntry::float64),
          {10000});
  }
  for (const char* method : {"average", "weighted", "ward", "centroid", "median"}) {
    for (const auto& [name, input] : {std::pair{"/cube", Input::cube}, {"/grid", Input::grid}}) {
      sizes(benchmark::RegisterBenchmark((std::string(method) + name).c_str(), by_method, input,
                                         *linkage_method_named(method)),
            {10000});
    }
  }
  sizes(benchmark::RegisterBenchmark("complete/float/shuffled", complete_function, false), {10000});
  sizes(benchmark::RegisterBenchmark("complete/float/row", complete_function, true), {10000});
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
