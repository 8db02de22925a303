// SPDX-License-Identifier: Apache-2.0
// Measures error-bounded meshes of a raster in windows of 512 cells, on one thread: the triangles,
// and the seconds of meshing (including the settling of sides) and of the check at every sample.
// Also selects samples for Delaunay triangulations in windows of 128 cells. The samples that two
// windows share count twice.
//
// The raster is the file of 32-bit floats named by TERRACE_GRID, with TERRACE_GRID_COLUMNS per row.
// Without it, a synthetic raster is used: fractal relief of about the same roughness.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "terrace/tri/grid_tin.hpp"

namespace {

using namespace terrace::tri;

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;

struct Raster {
  std::uint32_t columns = 0, rows = 0;
  std::vector<float> heights;
  std::span<const float> row(std::uint32_t y, std::uint32_t x, std::uint32_t count) const {
    return {heights.data() + std::size_t{y} * columns + x, count};
  }
};

/// Diamond-square algorithm; amplitudes fall by 2^-0.8 per level (A. Fournier, D. Fussell, L.
/// Carpenter, "Computer rendering of stochastic models", 1982).
Raster fractal(std::uint32_t cells) {
  Raster raster{cells + 1, cells + 1, {}};
  const std::size_t stride = raster.columns;
  std::vector<double> z(stride * stride, 0.0);
  std::mt19937_64 random(1);
  const auto noise = [&](double amplitude) {
    return amplitude * (static_cast<double>(random() >> 11) * 0x1p-52 - 1);
  };
  double amplitude = kSmall ? 60 : 700;
  const auto at = [&](std::size_t x, std::size_t y) -> double& { return z[y * stride + x]; };
  for (std::size_t step = cells; step > 1; step /= 2) {
    const std::size_t half = step / 2;
    for (std::size_t y = half; y < cells; y += step)
      for (std::size_t x = half; x < cells; x += step)
        at(x, y) = (at(x - half, y - half) + at(x + half, y - half) + at(x - half, y + half) +
                    at(x + half, y + half)) /
                       4 +
                   noise(amplitude);
    for (std::size_t y = 0; y <= cells; y += half)
      for (std::size_t x = (y / half) % 2 == 0 ? half : 0; x <= cells; x += step) {
        double sum = 0, count = 0;
        if (x >= half) sum += at(x - half, y), ++count;
        if (x + half <= cells) sum += at(x + half, y), ++count;
        if (y >= half) sum += at(x, y - half), ++count;
        if (y + half <= cells) sum += at(x, y + half), ++count;
        at(x, y) = sum / count + noise(amplitude);
      }
    amplitude *= 0.5743491774985175;  // 2^-0.8
  }
  raster.heights.assign(z.begin(), z.end());
  return raster;
}

Raster read(const char* path) {
  const char* const columns = std::getenv("TERRACE_GRID_COLUMNS");
  if (columns == nullptr)
    throw std::runtime_error("TERRACE_GRID is set; set TERRACE_GRID_COLUMNS too");
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::runtime_error(std::string("cannot read ") + path);
  Raster raster;
  raster.columns = static_cast<std::uint32_t>(std::atoi(columns));
  raster.heights.resize(static_cast<std::size_t>(file.tellg()) / sizeof(float));
  raster.rows = static_cast<std::uint32_t>(raster.heights.size() / raster.columns);
  file.seekg(0);
  file.read(reinterpret_cast<char*>(raster.heights.data()),
            static_cast<std::streamsize>(raster.heights.size() * sizeof(float)));
  return raster;
}

const Raster& raster() {
  static const Raster raster = [] {
    const char* const path = std::getenv("TERRACE_GRID");
    return path != nullptr ? read(path) : fractal(kSmall ? 128 : 2048);
  }();
  return raster;
}

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Calls visit(window, sides) for the windows of this many cells.
template <class Visit>
void for_windows(double bound, const Visit& visit, std::uint32_t cells = 512) {
  const Raster& all = raster();
  std::vector<float> heights, line;
  for (std::uint32_t y = 0; y + 1 < all.rows; y += cells) {
    for (std::uint32_t x = 0; x + 1 < all.columns; x += cells) {
      const std::uint32_t columns = std::min(cells, all.columns - 1 - x) + 1;
      const std::uint32_t rows = std::min(cells, all.rows - 1 - y) + 1;
      heights.clear();
      for (std::uint32_t k = 0; k < rows; ++k) {
        const auto row = all.row(y + k, x, columns);
        heights.insert(heights.end(), row.begin(), row.end());
      }
      const auto along_row = [&](std::uint32_t at) {
        return settle_side<float>(all.row(at, x, columns), {}, {}, bound);
      };
      const auto along_column = [&](std::uint32_t at) {
        line.clear();
        for (std::uint32_t k = 0; k < rows; ++k)
          line.push_back(all.heights[std::size_t{y + k} * all.columns + at]);
        return settle_side<float>(line, {}, {}, bound);
      };
      visit(GridWindow<float>{columns, rows, heights},
            GridSides{along_row(y), along_row(y + rows - 1), along_column(x),
                      along_column(x + columns - 1)});
    }
  }
}

void mesh(benchmark::State& state) {
  GridTinOptions options;
  options.max_error = static_cast<double>(state.range(1));
  options.quality = static_cast<TinQuality>(state.range(0));
  options.measure = false;
  double checking = 0, most = 0, squares = 0, covered = 0;
  std::size_t triangles = 0, missed = 0;
  for (auto _ : state) {
    triangles = missed = 0;
    checking = most = squares = covered = 0;
    for_windows(options.max_error, [&](const GridWindow<float>& window, const GridSides& sides) {
      const GridTin tin = grid_tin(window, sides, options);
      const double start = steady_seconds();
      std::vector<Point3> points;
      points.reserve(tin.vertices.size());
      for (const GridVertex& v : tin.vertices)
        points.push_back({static_cast<double>(v.column), static_cast<double>(v.row), v.height});
      const GridTinCheck check = check_grid_tin<float>(window, points, tin.triangles);
      checking += steady_seconds() - start;
      triangles += tin.triangles.size();
      missed += check.uncovered_inner + check.nodata_covered + check.inverted;
      most = std::max(most, check.max_error);
      const auto samples = static_cast<double>(check.covered);
      squares += check.rms_error * check.rms_error * samples;
      covered += samples;
    });
  }
  if (missed != 0 || most > options.max_error) state.SkipWithError("not within the bound");
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(raster().heights.size()));
  state.counters["triangles"] = static_cast<double>(triangles);
  state.counters["of_check_s"] = checking;
  state.counters["max"] = most;
  state.counters["rms"] = covered > 0 ? std::sqrt(squares / covered) : 0;
}

void selection(benchmark::State& state) {
  const auto bound = static_cast<double>(state.range(0));
  std::size_t samples = 0;
  for (auto _ : state) {
    samples = 0;
    const auto visit = [&](const GridWindow<float>& window, const GridSides& sides) {
      samples += select_samples(window, sides, bound).size();
    };
    for_windows(bound, visit, 128);
  }
  state.counters["samples"] = static_cast<double>(samples);
}

void best_of_points(benchmark::State& state) {
  const Raster& all = raster();
  GridTin tin;
  for (auto _ : state)
    tin = grid_tin_of_points<float>({all.columns, all.rows, all.heights},
                                    static_cast<std::size_t>(state.range(0)), {});
  state.counters["max"] = tin.check.max_error;
}

void settings(benchmark::internal::Benchmark* benchmark) {
  for (const int quality : {0, 1, 2})
    for (const int bound : {20, 5, 1}) benchmark->Args({quality, bound});
}

BENCHMARK(mesh)->ArgNames({"quality", "bound"})->Apply(settings)->Unit(benchmark::kMillisecond);
BENCHMARK(selection)->ArgName("bound")->Arg(20)->Arg(5)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(best_of_points)
    ->ArgName("points")
    ->Arg(kSmall ? 500 : 20'000)
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
