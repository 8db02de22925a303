// SPDX-License-Identifier: Apache-2.0
// Linkage on a GPU: wall time from points to dendrogram, including copies and memory, after the
// device is awake, for 5,000 to 40,000 points uniform in a cube (TERRACE_BENCH_SMALL: 500). The
// counters are the seconds that one core of this machine takes for the same task, and the speed-up
// of the GPU. Checks that the heights are equal. With floats, ties occur and heights may differ, so
// there it checks that the smallest set is clustered by a valid run of complete linkage. Without a
// device it reports so and does nothing.
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include <benchmark/benchmark.h>

#include "../tests/linkage_laws.hpp"
#include "terrace/cluster/linkage.hpp"

namespace {

using namespace terrace::cluster;

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;

const int kLeast = kSmall ? 500 : 5000;

enum class Kind { complete_float, complete_double, single };

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Dendrogram on_cpu(Kind kind, const std::vector<Point3>& points) {
  if (kind == Kind::single) return single_linkage(points);
  return complete_linkage(points, {.entry = kind == Kind::complete_float ? MatrixEntry::float32
                                                                         : MatrixEntry::float64});
}

Dendrogram on_gpu(Kind kind, const std::vector<Point3>& points) {
  if (kind == Kind::single) return cuda_single_linkage(points);
  return cuda_complete_linkage(
      points, kind == Kind::complete_float ? MatrixEntry::float32 : MatrixEntry::float64);
}

bool equal_heights(const Dendrogram& a, const Dendrogram& b) {
  if (a.merges.size() != b.merges.size()) return false;
  for (std::size_t r = 0; r < a.merges.size(); ++r) {
    if (a.merges[r].height != b.merges[r].height) return false;
  }
  return true;
}

void compare(benchmark::State& state, Kind kind) {
  std::mt19937_64 random(20);
  const std::vector<Point3> points = inputs::cube(static_cast<std::size_t>(state.range(0)), random);
  auto start = std::chrono::steady_clock::now();
  const Dendrogram expected = on_cpu(kind, points);
  const double cpu = seconds_since(start);
  Dendrogram dendrogram = on_gpu(kind, points);  // wakes the device
  start = std::chrono::steady_clock::now();
  std::size_t runs = 0;
  for ([[maybe_unused]] const auto iteration : state) {
    dendrogram = on_gpu(kind, points);
    ++runs;
  }
  const double gpu = seconds_since(start) / static_cast<double>(runs);
  state.counters["core_s"] = cpu;
  state.counters["times_core"] = cpu / gpu;
  if (kind != Kind::complete_float) {
    if (!equal_heights(dendrogram, expected)) state.SkipWithError("the heights differ");
  } else if (state.range(0) == kLeast) {
    const std::string fault =
        laws::complete_fault(dendrogram, laws::distances_of(points), laws::kFloatTolerance);
    if (!fault.empty()) state.SkipWithError(fault.c_str());
  }
}

}  // namespace

int main(int argc, char** argv) {
  const CudaStatus status = cuda_available();
  if (!status.available) {
    std::printf("skipped: %s\n", status.reason.c_str());
    return 0;
  }
  std::printf("device: %s\n", status.device.c_str());
  for (const auto& [name, kind] : {std::pair{"complete/float", Kind::complete_float},
                                   {"complete/double", Kind::complete_double},
                                   {"single", Kind::single}}) {
    auto* const registered = benchmark::RegisterBenchmark(name, compare, kind)
                                 ->UseRealTime()
                                 ->Unit(benchmark::kMillisecond);
    registered->Arg(kLeast);
    if (kSmall) continue;
    for (const int count : {10000, 20000, 40000}) registered->Arg(count);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
