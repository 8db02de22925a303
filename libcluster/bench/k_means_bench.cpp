// SPDX-License-Identifier: Apache-2.0
// k-means: measures seconds for seeds and iterations separately, on synthetic inputs:
//   grid   n points around the k knots of a square grid in the plane, as in the set birch1
//   cube   uniform in a cube
// They start at n = 100,000 and k = 100 (TERRACE_BENCH_SMALL: n = 2,000, k = 20). The counters are
// the iterations until no assignment changes (at most 300), the time per iteration, and the ratio
// of the SSE to that of the k-means++ seeds.
//
// With `--peer POINTS CENTRES` it runs once per repetition on files of raw doubles, three per
// point, and prints the seconds of each run, then SSE and iterations. See k_means_peers.py.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string_view>

#include <benchmark/benchmark.h>

#include "../tests/inputs.hpp"
#include "terrace/cluster/k_means.hpp"

namespace {

using namespace terrace::cluster;

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;

std::vector<Point3> grid(std::size_t count, std::size_t side, std::mt19937_64& random) {
  std::vector<Point3> points(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t knot = i % (side * side);
    points[i] = {static_cast<double>(knot % side) + 0.25 * inputs::bell(random),
                 static_cast<double>(knot / side) + 0.25 * inputs::bell(random), 0.0};
  }
  inputs::shuffle(points, random);
  return points;
}

std::vector<Point3> make_input(bool plane, std::size_t count, std::size_t side) {
  std::mt19937_64 random(20);
  return plane ? grid(count, side, random) : inputs::cube(count, random);
}

void iterate(benchmark::State& state, bool plane, std::size_t count, std::size_t side,
             unsigned threads) {
  const std::vector<Point3> points = make_input(plane, count, side);
  KMeansOptions options;
  options.clusters = side * side;
  options.threads = threads;
  options.max_iterations = 0;
  const KMeansResult seeds = k_means(points, {}, options);
  options.max_iterations = 300;
  KMeansResult result;
  for ([[maybe_unused]] const auto iteration : state) {
    result = k_means_from(seeds.centres, points, {}, options);
  }
  const auto iterations = static_cast<double>(result.iterations);
  state.counters["iterations"] = iterations;
  state.counters["per_iteration"] =
      benchmark::Counter(iterations * static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["SSE_to_seeds"] = result.sse / seeds.sse;
}

void seed(benchmark::State& state, bool plane, std::size_t count, std::size_t side) {
  const std::vector<Point3> points = make_input(plane, count, side);
  KMeansOptions options;
  options.clusters = side * side;
  options.max_iterations = 0;
  for ([[maybe_unused]] const auto iteration : state) {
    benchmark::DoNotOptimize(k_means(points, {}, options).centres.data());
  }
}

std::vector<Point3> read_points(const char* path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) {
    std::fprintf(stderr, "%s cannot be read\n", path);
    std::exit(1);
  }
  std::vector<Point3> points(static_cast<std::size_t>(file.tellg()) / sizeof(Point3));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(points.data()),
            static_cast<std::streamsize>(points.size() * sizeof(Point3)));
  return points;
}

int run_as_peer(const char* points_path, const char* centres_path) {
  const std::vector<Point3> points = read_points(points_path);
  const std::vector<Point3> centres = read_points(centres_path);
  KMeansOptions options;
  options.max_iterations = 100000;
  KMeansResult result;
  for (int run = 0; run < 5; ++run) {
    const auto start = std::chrono::steady_clock::now();
    result = k_means_from(centres, points, {}, options);
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
    std::printf("%.6f ", time.count());
  }
  std::printf("%.17g %zu\n", result.sse, result.iterations);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 4 && std::string_view(argv[1]) == "--peer") return run_as_peer(argv[2], argv[3]);
  struct Size {
    std::size_t count, side;
  };
  const std::vector<Size> sizes =
      kSmall ? std::vector<Size>{{2000, 5}} : std::vector<Size>{{100000, 10}, {1000000, 30}};
  for (const bool plane : {true, false}) {
    for (const auto& [count, side] : sizes) {
      const std::string name = std::string(plane ? "grid" : "cube") +
                               "/n=" + std::to_string(count) + "/k=" + std::to_string(side * side);
      benchmark::RegisterBenchmark((name + "/seeds").c_str(), seed, plane, count, side)
          ->Unit(benchmark::kMillisecond);
      for (const unsigned threads : {1u, 2u}) {
        benchmark::RegisterBenchmark((name + "/threads=" + std::to_string(threads)).c_str(),
                                     iterate, plane, count, side, threads)
            ->Unit(benchmark::kMillisecond)
            ->UseRealTime();
      }
    }
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
