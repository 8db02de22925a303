// SPDX-License-Identifier: Apache-2.0
// Measures stores of a fractal int16 raster (midpoint displacement with an RMS step of about 2.65 m
// from cell to cell) and of a cloud of decimals on a surface: encoding, reading everything, reading
// random clusters, and the size. A simple hierarchy builder clusters the blocks once beforehand.
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <random>

#include <benchmark/benchmark.h>
#include <unistd.h>

#include "../tests/read_pieces.hpp"
#include "../tests/stand_in_hierarchy.hpp"
#include "../tests/store_inputs.hpp"
#include "terrace/stream/store.hpp"

namespace {

using namespace terrace::stream;
using testing::StandInHierarchy;

bool is_small() { return std::getenv("TERRACE_BENCH_SMALL") != nullptr; }

struct Input {
  StoreSchema schema;
  std::vector<store::RawBlock> blocks;
  std::uint64_t points = 0;
};

const Input& input(bool grid) {
  const auto make = [](bool of_grid) {
    Input input;
    std::vector<std::vector<Point3>> blocks;
    StandInHierarchy::Options options;
    input.schema.grid = of_grid;
    if (of_grid) {
      input.schema.coordinates[2].type = ScalarType::i16;
      const int side = is_small() ? 256 : 2048;
      input.schema.columns = input.schema.rows = static_cast<std::uint64_t>(side);
      const auto heights = testing::fractal_heights(side, 2.65, 1);
      for (int y = 0; y < side; y += 100) {
        for (int x = 0; x < side; x += 100) {
          blocks.push_back(testing::tile(heights, side, side, x, y, 100));
        }
      }
      options.scale = {30, 30, 1};
    } else {
      const int patches = is_small() ? 8 : 256;
      for (int p = 0; p < patches; ++p) blocks.push_back(testing::scan_patch(p, 10000));
      options.cluster_points = 100;
    }
    for (const auto& block : blocks) input.points += block.size();
    input.blocks = testing::recorded_hierarchy(blocks, options);
    return input;
  };
  static const Input grid_input = make(true), cloud_input = make(false);
  return grid ? grid_input : cloud_input;
}

std::filesystem::path store_path(bool grid) {
  return std::filesystem::temp_directory_path() /
         (std::string("terrace-store-bench-") + (grid ? "grid-" : "cloud-") +
          std::to_string(::getpid()));
}

std::uint64_t write(const Input& in, const std::filesystem::path& path) {
  StoreWriter writer(path, in.schema, /*replace=*/true);
  for (const store::RawBlock& block : in.blocks) {
    if (&block == &in.blocks.back()) return writer.finish(block.view());
    writer.append(writer.encode(block.view()));
  }
  return 0;
}

/// Returns a store that exists as long as the program.
const Store& built(bool grid) {
  struct Built {
    explicit Built(bool of_grid) : path(store_path(of_grid)) {
      write(input(of_grid), path);
      store.emplace(Store::open(path));
    }
    ~Built() { std::filesystem::remove_all(path); }
    std::filesystem::path path;
    std::optional<Store> store;
  };
  static Built grid_store(true), cloud_store(false);
  return *(grid ? grid_store : cloud_store).store;
}

void count_points(benchmark::State& state, std::uint64_t points) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(points));
}

/// Measures encode() of blocks whose tables exist, without I/O.
void encode(benchmark::State& state, bool grid) {
  const Input& in = input(grid);
  const auto path = store_path(grid).string() + "-encode";
  StoreWriter writer(path, in.schema, true);
  std::vector<ClusteredBlock> level0;
  for (const store::RawBlock& block : in.blocks) {
    if (block.level == 0) level0.push_back(block.view());
  }
  // Tables are made from 64 blocks; a small input is repeated as often as necessary.
  for (std::size_t b = 0; b < 64; ++b) writer.append(writer.encode(level0[b % level0.size()]));
  std::uint64_t points = 0;
  for (auto _ : state) {
    for (const ClusteredBlock& block : level0) {
      benchmark::DoNotOptimize(writer.encode(block));
      points += block.positions.size();
    }
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(points));
}

/// Measures reading every cluster of every level, with checksums, on one thread.
void read_all(benchmark::State& state, bool grid) {
  const Store& store = built(grid);
  double sum = 0;
  for (auto _ : state) {
    for (unsigned level = 0; level <= store.top(); ++level) {
      store.for_each(level, [&](ClusterId, const ClusterRecord&, const ClusterPoints& points) {
        if (points.size() > 0) sum += points.positions[0][2];
      });
    }
  }
  benchmark::DoNotOptimize(sum);
  count_points(state, store.points());
  state.counters["bytes_per_point"] =
      static_cast<double>(store.bytes()) / static_cast<double>(store.points());
  std::uint64_t index = 0, clusters = 0;
  for (const LevelInfo& level : store.levels()) {
    index += level.index_bytes;
    clusters += level.clusters;
  }
  state.counters["index_bytes_per_cluster"] =
      static_cast<double>(index) / static_cast<double>(clusters);
}

/// Measures reading one random cluster of level 0: its record and points.
void read_one(benchmark::State& state, bool grid) {
  const Store& store = built(grid);
  std::mt19937_64 random(1);
  ClusterPoints points;
  for (auto _ : state) {
    const ClusterId id = cluster_id(0, random() % store.levels()[0].clusters);
    benchmark::DoNotOptimize(store.record(id));
    store.read(id, points);
  }
}

/// Measures repack() of a store, TERRACE_BENCH_STORE if it is set. Reports how much larger the
/// store gets, and in how many pieces a window of a tenth of each side is read before and after.
void repack_store(benchmark::State& state, bool grid) {
  const char* const named = std::getenv("TERRACE_BENCH_STORE");
  const Store store = named != nullptr ? Store::open(std::filesystem::path(named)) : built(grid);
  const auto path = store_path(grid).string() + "-packed";
  std::uint64_t bytes = 0;
  for (auto _ : state) bytes = repack(store, path, /*replace=*/true);
  count_points(state, store.points());
  const auto boxes = testing::windows(store.bounds(), 0.1, 40, 1);
  const auto before = testing::pieces_read(store.path(), boxes);
  const auto after = testing::pieces_read(path, boxes);
  std::filesystem::remove_all(path);
  const auto mean = [&](std::size_t pieces) {
    return static_cast<double>(pieces) / static_cast<double>(boxes.size());
  };
  state.counters["size"] = static_cast<double>(bytes) / static_cast<double>(store.bytes());
  state.counters["clusters_before"] = mean(before.clusters);
  state.counters["clusters_after"] = mean(after.clusters);
  state.counters["index_before"] = mean(before.index);
  state.counters["index_after"] = mean(after.index);
}

BENCHMARK_CAPTURE(encode, grid, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_all, grid, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_one, grid, true)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(encode, cloud, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_all, cloud, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_one, cloud, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(repack_store, grid, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(repack_store, cloud, false)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
