// SPDX-License-Identifier: Apache-2.0
// Measures error-bounded surfaces of 4.2 million irregular points over fractal terrain (midpoint
// displacement of exponent 0.8; a small one with TERRACE_BENCH_SMALL), on one thread, at errors
// that leave about 1 % and about half of the samples as vertices of the greedy surface. Counters
// give vertices, triangles, and the largest error according to the independent measurement (whose
// time has its own benchmark). `tile`: samples on a lattice, within a frame.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include <benchmark/benchmark.h>

#include "terrace/tri/point_tin.hpp"

namespace {

using terrace::tri::measure_surface;
using terrace::tri::Point3;
using terrace::tri::point_tin;
using terrace::tri::PointTin;
using terrace::tri::PointTinOptions;
using terrace::tri::TinErrors;
using terrace::tri::TinQuality;

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;
const std::size_t kSide = kSmall ? 65 : 2049;
const std::size_t kCount = kSmall ? 4000 : 4'200'000;

double unit(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

/// Diamond-square algorithm, with amplitude 1000 at the largest step.
std::vector<double> terrain() {
  std::vector<double> height(kSide * kSide, 0.0);
  std::mt19937_64 random(1);
  double amplitude = 1000;
  for (std::size_t step = kSide - 1; step > 1; step /= 2, amplitude *= std::exp2(-0.8)) {
    const std::size_t half = step / 2;
    const auto at = [&](std::size_t i, std::size_t j) -> double& { return height[j * kSide + i]; };
    for (std::size_t j = half; j < kSide; j += step)
      for (std::size_t i = half; i < kSide; i += step)
        at(i, j) = (at(i - half, j - half) + at(i + half, j - half) + at(i - half, j + half) +
                    at(i + half, j + half)) /
                       4 +
                   amplitude * (2 * unit(random) - 1);
    for (std::size_t j = 0; j < kSide; j += half) {
      for (std::size_t i = (j / half + 1) % 2 * half; i < kSide; i += step) {
        double sum = 0;
        double count = 0;
        const auto add = [&](std::size_t a, std::size_t b) {
          sum += at(a, b);
          ++count;
        };
        if (i >= half) add(i - half, j);
        if (i + half < kSide) add(i + half, j);
        if (j >= half) add(i, j - half);
        if (j + half < kSide) add(i, j + half);
        at(i, j) = sum / count + amplitude * (2 * unit(random) - 1);
      }
    }
  }
  return height;
}

struct Input {
  std::vector<double> x, y, z;
};
const Input& input() {
  static const Input made = [] {
    const std::vector<double> height = terrain();
    std::mt19937_64 random(2);
    Input result;
    const auto extent = static_cast<double>(kSide - 1);
    for (std::size_t k = 0; k < kCount; ++k) {
      const double x = unit(random) * extent;
      const double y = unit(random) * extent;
      const auto i = static_cast<std::size_t>(x);
      const auto j = static_cast<std::size_t>(y);
      const double u = x - static_cast<double>(i);
      const double v = y - static_cast<double>(j);
      const double* row = &height[j * kSide + i];
      result.x.push_back(10 * x);
      result.y.push_back(10 * y);
      result.z.push_back((1 - v) * ((1 - u) * row[0] + u * row[1]) +
                         v * ((1 - u) * row[kSide] + u * row[kSide + 1]));
    }
    return result;
  }();
  return made;
}

PointTin make(double max_error, TinQuality quality) {
  PointTinOptions options;
  options.max_error = max_error;
  options.quality = quality;
  return point_tin(input().x, input().y, input().z, {}, options);
}

void mesh(benchmark::State& state, double max_error, TinQuality quality) {
  input();
  PointTin tin;
  for (auto _ : state) tin = make(max_error, quality);
  const TinErrors errors =
      measure_surface(input().x, input().y, input().z, tin.vertices, tin.triangles);
  if (errors.largest > max_error || errors.uncovered > 0) state.SkipWithError("bound exceeded");
  state.counters["vertices"] = static_cast<double>(tin.vertices.size());
  state.counters["triangles"] = static_cast<double>(tin.triangles.size());
  state.counters["largest"] = errors.largest;
  state.counters["rms"] = errors.rms;
}

void measure(benchmark::State& state, double max_error) {
  const PointTin tin = make(max_error, TinQuality::greedy);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        measure_surface(input().x, input().y, input().z, tin.vertices, tin.triangles));
}

/// The samples of a 16th of the area as a tile on its lattice of 15 bits, with sides of 33
/// vertices.
void tile(benchmark::State& state, double max_error) {
  const double extent = 10 * static_cast<double>(kSide - 1) / 4;
  const double scale = 32767 / extent;
  std::vector<double> x, y, z;
  for (std::size_t i = 0; i < kCount; ++i) {
    if (input().x[i] > extent || input().y[i] > extent) continue;
    x.push_back(input().x[i] * scale);
    y.push_back(input().y[i] * scale);
    z.push_back(input().z[i]);
  }
  std::vector<Point3> frame;
  for (int side = 0; side < 4; ++side) {
    for (int k = 0; k < 32; ++k) {
      const double t = std::floor(32767.0 * k / 32);
      const double u = 32767 - t;
      frame.push_back(side == 0   ? Point3{t, 0, 0}
                      : side == 1 ? Point3{32767, t, 0}
                      : side == 2 ? Point3{u, 32767, 0}
                                  : Point3{0, u, 0});
    }
  }
  PointTinOptions options;
  options.max_error = max_error;
  options.lattice = terrace::tri::TinLattice{-4000, 8000.0 / 32767};
  PointTin tin;
  for (auto _ : state) tin = point_tin(x, y, z, frame, options);
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * x.size()));
  state.counters["samples"] = static_cast<double>(x.size());
  state.counters["vertices"] = static_cast<double>(tin.vertices.size());
  state.counters["stuck"] = static_cast<double>(tin.stuck);
}

constexpr double kOnePercent = 15.5;
constexpr double kHalf = 0.85;
#define TIN(name, ...) BENCHMARK_CAPTURE(mesh, name, __VA_ARGS__)->Unit(benchmark::kMillisecond)
TIN(greedy_one_percent, kOnePercent, TinQuality::greedy);
TIN(removal_one_percent, kOnePercent, TinQuality::removal);
TIN(fitted_one_percent, kOnePercent, TinQuality::fitted);
TIN(greedy_half, kHalf, TinQuality::greedy);
TIN(removal_half, kHalf, TinQuality::removal);
BENCHMARK_CAPTURE(tile, one_percent, kOnePercent)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(tile, tenth_of_it, kOnePercent / 10)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(measure, one_percent, kOnePercent)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
