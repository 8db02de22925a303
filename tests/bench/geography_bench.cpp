// SPDX-License-Identifier: GPL-3.0-or-later
// Longitudes and latitudes on one core: of a raster's samples by window, of random places in a box,
// and of single places, which shows the cost without the polynomials. Also geoid heights.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include <benchmark/benchmark.h>

#include "earth/geography.hpp"
#include "earth/geoid_heights.hpp"
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

/// Random places within 1024 x 1024 cells.
std::vector<Point2> places_of(const Grid& grid) {
  std::vector<Point2> list(4096);
  for (std::size_t i = 0; i < list.size(); ++i) {
    const auto column = static_cast<double>(i * 619 % 1024),
               row = static_cast<double>(i * 173 % 1024);
    list[i] = {grid.world.xy[2] + grid.world.xy[0] * column,
               grid.world.xy[5] + grid.world.xy[4] * row};
  }
  return list;
}

void in_box(benchmark::State& state) {
  const Grid& grid = kGrids[state.range(0)];
  state.SetLabel(grid.crs);
  const std::vector<Point2> list = places_of(grid);
  terrace::stream::Box3 box;
  for (const Point2& p : list) box.include(terrace::stream::Point3{p[0], p[1], 0.0});
  const terrace::terrain::BoxGeography geography(CoordinateSystem::parse(grid.crs), box);
  std::vector<Point2> found;
  for (auto _ : state) {
    found = list;
    geography(found);
    benchmark::DoNotOptimize(found.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(list.size()));
}
BENCHMARK(in_box)->DenseRange(0, 4);

void places(benchmark::State& state) {
  const Grid& grid = kGrids[state.range(0)];
  state.SetLabel(grid.crs);
  const CoordinateSystem system = CoordinateSystem::parse(grid.crs);
  const std::vector<Point2> list = places_of(grid);
  std::vector<Point2> found;
  for (auto _ : state) {
    found = list;
    system.to_geographic(found);
    benchmark::DoNotOptimize(found.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(list.size()));
}
BENCHMARK(places)->DenseRange(0, 4);

/// Adds EGM96 to heights at 400 x 400 places 1, 3 or 9 arc seconds apart; argument 0: place by
/// place.
void geoid(benchmark::State& state) {
  terrace::stream::StoreSchema schema;
  const terrace::terrain::EllipsoidalHeights ellipsoidal(
      schema, terrace::terrain::HeightReference::orthometric, {}, std::uint64_t{64} << 20);
  const bool alone = state.range(0) == 0;
  const double step = static_cast<double>(alone ? 3 : state.range(0)) / 3600;
  state.SetLabel(alone ? "one by one" : "together");
  constexpr std::size_t kSide = 400;
  std::vector<Point2> places;
  for (std::size_t i = 0; i < kSide * kSide; ++i) {
    places.push_back({8.1 + static_cast<double>(i % kSide) * step,
                      46.1 + static_cast<double>(i / kSide) * step});
  }
  const std::size_t together = alone ? 1 : places.size();
  std::vector<double> heights(places.size());
  for (auto _ : state) {
    for (std::size_t i = 0; i < places.size(); i += together) {
      ellipsoidal.add_geoid(std::span(places).subspan(i, together),
                            std::span(heights).subspan(i, together));
    }
    benchmark::DoNotOptimize(heights.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(places.size()));
}
BENCHMARK(geoid)->Arg(0)->Arg(1)->Arg(3)->Arg(9);

}  // namespace

BENCHMARK_MAIN();
