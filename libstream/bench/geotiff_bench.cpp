// SPDX-License-Identifier: Apache-2.0
// Measures reading rasters as points on one thread, from the page cache. The terrain is 16-bit
// value noise: the sum of a few octaves of a lattice of random values.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <unistd.h>

#include "terrace/stream/geotiff_writer.hpp"
#include "terrace/stream/raster.hpp"

namespace stream = terrace::stream;

namespace {

std::uint32_t side() { return std::getenv("TERRACE_BENCH_SMALL") != nullptr ? 300 : 8192; }

/// Returns a random value in 0 ... 1023 for a node of the lattice.
std::uint32_t noise(std::uint32_t x, std::uint32_t y) {
  std::uint64_t h = (std::uint64_t{x} << 32 | y) * 0x9e3779b97f4a7c15u;
  h = (h ^ h >> 29) * 0xbf58476d1ce4e5b9u;
  return static_cast<std::uint32_t>(h >> 54);
}

std::int16_t height(std::uint32_t column, std::uint32_t row) {
  std::uint32_t sum = 0;
  for (unsigned octave = 10; octave >= 2; octave -= 2) {
    const std::uint32_t cell = 1u << octave, mask = cell - 1;
    const std::uint32_t x = column >> octave, y = row >> octave;
    const std::uint32_t fx = column & mask, fy = row & mask;
    const std::uint32_t top = noise(x, y) * (cell - fx) + noise(x + 1, y) * fx;
    const std::uint32_t bottom = noise(x, y + 1) * (cell - fx) + noise(x + 1, y + 1) * fx;
    const std::uint64_t value = std::uint64_t{top} * (cell - fy) + std::uint64_t{bottom} * fy;
    sum += static_cast<std::uint32_t>(value >> (2 * octave)) * cell / 1024;
  }
  return static_cast<std::int16_t>(sum);
}

/// The input files, which are written once and removed at the end.
class Inputs {
 public:
  Inputs()
      : folder_(std::filesystem::temp_directory_path() /
                ("geotiff_bench-" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~Inputs() { std::filesystem::remove_all(folder_); }
  Inputs(const Inputs&) = delete;
  Inputs& operator=(const Inputs&) = delete;

  const std::string& file(stream::GeoTiffCompression compression, bool nodata) {
    std::string& name = names_[{static_cast<int>(compression), nodata}];
    if (!name.empty()) return name;
    name = (folder_ / std::to_string(names_.size())).string() + ".tif";
    stream::GeoTiffOptions options;
    options.columns = options.rows = side();
    options.sample.type = stream::ScalarType::i16;
    options.compression = compression;
    if (nodata) options.nodata = 100;
    stream::GeoTiffWriter writer(name, options);
    std::vector<std::int16_t> line(options.columns);
    for (std::uint32_t row = 0; row < options.rows; ++row) {
      for (std::uint32_t c = 0; c < options.columns; ++c) line[c] = height(c, row);
      writer.write_rows(std::as_bytes(std::span(line)));
    }
    writer.commit();
    return name;
  }

 private:
  std::filesystem::path folder_;
  std::map<std::pair<int, bool>, std::string> names_;
};

Inputs& inputs() {
  static Inputs all;
  return all;
}

void read_points(benchmark::State& state, stream::GeoTiffCompression compression, bool nodata) {
  const std::string file = inputs().file(compression, nodata);
  std::uint64_t points = 0;
  for (auto _ : state) {
    const auto source = stream::points_of(stream::open_geotiff(file));
    stream::PointBlock block;
    while (source->next(block)) benchmark::DoNotOptimize(block.positions.data());
    points += source->progress().points;
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(points));
}

/// Measures the lower limit of the time: libtiff's decoding and the copy into windows, without
/// points.
void read_windows(benchmark::State& state, stream::GeoTiffCompression compression) {
  const std::string file = inputs().file(compression, false);
  const auto raster = stream::open_geotiff(file);
  const std::uint64_t columns = raster->info().columns, rows = raster->info().rows;
  std::vector<std::byte> samples(columns * 256 * 2);
  std::vector<std::uint8_t> valid(columns * 256);
  for (auto _ : state) {
    for (std::uint64_t row = 0; row < rows; row += 256) {
      raster->read_over({0, row, columns, std::min<std::uint64_t>(256, rows - row)},
                        {samples.data(), valid.data(), columns});
    }
    benchmark::DoNotOptimize(samples.data());
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(columns * rows));
}

void write_file(benchmark::State& state, stream::GeoTiffCompression compression) {
  const std::string source = inputs().file(stream::GeoTiffCompression::none, false);
  const auto raster = stream::open_geotiff(source);
  const std::uint64_t columns = raster->info().columns, rows = raster->info().rows;
  std::vector<std::byte> samples(columns * rows * 2);
  std::vector<std::uint8_t> valid(columns * rows);
  raster->read_over({0, 0, columns, rows}, {samples.data(), valid.data(), columns});
  stream::GeoTiffOptions options;
  options.columns = options.rows = side();
  options.sample.type = stream::ScalarType::i16;
  options.compression = compression;
  options.replace = true;
  for (auto _ : state) {
    stream::GeoTiffWriter writer(source + ".out", options);
    writer.write_rows(samples);
    writer.commit();
  }
  std::filesystem::remove(source + ".out");
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(columns * rows));
}

using Codec = stream::GeoTiffCompression;
BENCHMARK_CAPTURE(read_points, none, Codec::none, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_points, none_with_nodata, Codec::none, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_points, deflate, Codec::deflate, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_points, zstd, Codec::zstd, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_windows, none, Codec::none)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_windows, deflate, Codec::deflate)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_windows, zstd, Codec::zstd)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(write_file, none, Codec::none)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(write_file, deflate, Codec::deflate)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
