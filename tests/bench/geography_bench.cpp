// SPDX-License-Identifier: GPL-3.0-or-later
// Longitudes and latitudes of a raster's samples by window, and of single places, on one core. The
// second kind is what the first would cost without its polynomials.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include <benchmark/benchmark.h>

#include "earth/grid_geography.hpp"
#include "terrace/terrain/crs.hpp"

namespace {

using terrace::terrain::CoordinateSystem;
using terrace::terrain::GridGeography;
using terrace::terrain::Point2;

struct Grid {
  const char* crs;
  terrace::stream::WorldTransform world;
};
constexpr Grid kGrids[] = {{"EPSG:32632", {{30, 0, 400000, 0, -30, 5200000}}},
                           {"EPSG:3857", {{30, 0, 900000, 0, -30, 6000000}}},
                           {"EPSG:3035", {{25, 0, 4000000, 0, -25, 3000000}}},
                           {"EPSG:3413", {{250, 0, 400000, 0, -250, -800000}}},
                           {"EPSG:5514", {{10, 0, -742000, 0, -10, -1043000}}}};

std::size_t side() { return std::getenv("TERRACE_BENCH_SMALL") != nullptr ? 128 : 1024; }

void windows(benchmark::State& state) {
  const Grid& grid = kGrids[state.range(0)];
  state.SetLabel(grid.crs);
  const GridGeography geography(CoordinateSystem::parse(grid.crs), grid.world);
  const std::size_t cells = side() * side();
  std::vector<double> longitude(cells), latitude(cells);
  std::int64_t row = 0;
  for (auto _ : state) {
    geography.window(0, row, side(), side(), longitude, latitude);
    benchmark::DoNotOptimize(longitude.data());
    row = (row + 7) % 1000;
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(cells));
}
BENCHMARK(windows)->DenseRange(0, 4);

void places(benchmark::State& state) {
  const Grid& grid = kGrids[state.range(0)];
  state.SetLabel(grid.crs);
  const CoordinateSystem system = CoordinateSystem::parse(grid.crs);
  std::vector<Point2> list(4096);
  for (auto _ : state) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      list[i] = {grid.world.xy[2] + 30.0 * static_cast<double>(i), grid.world.xy[5]};
    }
    system.to_geographic(list);
    benchmark::DoNotOptimize(list.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(list.size()));
}
BENCHMARK(places)->DenseRange(0, 4);

}  // namespace

BENCHMARK_MAIN();
