// SPDX-License-Identifier: Apache-2.0
// Measures reading and writing of point files with a warm cache: survey coordinates (millimetres in
// a UTM zone), without attributes, with three, and with those of LAS point format 6. Items are
// points.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <unistd.h>

#include "terrace/stream/point_writer.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {
namespace {

std::size_t point_count() {
  return std::getenv("TERRACE_BENCH_SMALL") != nullptr ? 20'000 : 2'000'000;
}

enum class Columns : std::uint8_t { none, three, laser };

/// Points of a survey in blocks of 10,000; the last block is shorter.
class Survey {
 public:
  explicit Survey(Columns columns) : random_(1) {
    header_.lattice = Lattice{.scale = {0.001, 0.001, 0.001}, .offset = {691'000, 5'338'000, 0}};
    if (columns == Columns::three) {
      header_.attributes = {{.name = "intensity", .type = ScalarType::u16},
                            {.name = "class", .type = ScalarType::u8},
                            {.name = "confidence", .type = ScalarType::f32}};
    } else if (columns == Columns::laser) {
      for (const char* name : {"return_number", "number_of_returns", "synthetic", "key_point",
                               "withheld", "overlap", "scanner_channel", "scan_direction_flag",
                               "edge_of_flight_line", "classification", "user_data"}) {
        header_.attributes.push_back({.name = name, .type = ScalarType::u8});
      }
      header_.attributes.push_back({.name = "scan_angle", .type = ScalarType::i16, .scale = 0.006});
      header_.attributes.push_back({.name = "intensity", .type = ScalarType::u16});
      header_.attributes.push_back({.name = "point_source_id", .type = ScalarType::u16});
      header_.attributes.push_back({.name = "gps_time", .type = ScalarType::f64});
    }
  }
  [[nodiscard]] const PointHeader& header() const { return header_; }

  void write(const std::string& path, const std::string& format) {
    const auto writer = open_point_writer(path, header_, {.format = format, .replace = true});
    for (std::size_t remaining = point_count(); remaining > 0;) {
      const PointBlock& block = make(std::min<std::size_t>(remaining, 10'000));
      writer->append(block);
      remaining -= block.size();
    }
    writer->finish();
  }
  const PointBlock& make(std::size_t count) {
    block_.positions.resize(count);
    for (Point3& p : block_.positions) {
      p = {static_cast<double>(691'000'000 + random_() % 2'000'000) / 1000.0,
           static_cast<double>(5'338'000'000 + random_() % 2'000'000) / 1000.0,
           static_cast<double>(random_() % 900'000) / 1000.0};
    }
    block_.payload.clear();
    for (std::size_t i = 0; i < count; ++i) {
      for (const Channel& channel : header_.attributes) {
        const float confidence = static_cast<float>(random_() % 1000) / 1000.0f;
        const double time = 0.25 * static_cast<double>(random_() % 1'000'000);
        // 8-bit columns are 0 or 1, which all bit fields of LAS can hold.
        const std::uint64_t bits = random_() & (channel.type == ScalarType::u8 ? 1U : ~0ULL);
        const auto bytes = channel.type == ScalarType::f32
                               ? std::as_bytes(std::span(&confidence, 1))
                           : channel.type == ScalarType::f64
                               ? std::as_bytes(std::span(&time, 1))
                               : std::as_bytes(std::span(&bits, 1)).first(size_of(channel.type));
        block_.payload.insert(block_.payload.end(), bytes.begin(), bytes.end());
      }
    }
    return block_;
  }

 private:
  std::mt19937_64 random_;
  PointHeader header_;
  PointBlock block_;
};

std::string scratch_file() {
  return std::filesystem::temp_directory_path() /
         ("terrace-bench-" + std::to_string(getpid()) + ".points");
}

void read(benchmark::State& state, const std::string& format, Columns columns) {
  const std::string path = scratch_file();
  Survey(columns).write(path, format);
  for (auto _ : state) {
    const auto source = open_source(std::span(&path, 1), {});
    PointBlock block;
    double sum = 0;
    while (source->next(block)) sum += block.positions.front()[0];
    benchmark::DoNotOptimize(sum);
  }
  const auto iterations = state.iterations();
  state.SetItemsProcessed(iterations * static_cast<std::int64_t>(point_count()));
  state.SetBytesProcessed(iterations * static_cast<std::int64_t>(std::filesystem::file_size(path)));
  std::filesystem::remove(path);
}

/// Measures writing without syncs, which would measure the disk: the file is abandoned after its
/// last point.
void write(benchmark::State& state, const std::string& format, Columns columns) {
  const std::string path = scratch_file();
  Survey survey(columns);
  const PointBlock block = survey.make(10'000);
  for (auto _ : state) {
    const auto writer =
        open_point_writer(path, survey.header(), {.format = format, .replace = true});
    for (std::size_t done = 0; done < point_count(); done += block.size()) writer->append(block);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(point_count()));
}

/// Measures writing COPC of a hilly survey, including syncs, because its work begins after the last
/// point.
void write_octree(benchmark::State& state) {
  const std::string path = scratch_file();
  Survey survey(Columns::laser);
  std::vector<PointBlock> blocks;
  for (std::size_t done = 0; done < point_count(); done += blocks.back().size()) {
    blocks.push_back(survey.make(10'000));
    for (Point3& p : blocks.back().positions) {
      p[2] = 300 + 0.001 * std::round(1000 * (90 * std::sin(p[0] / 300) + 0.02 * p[2]));
    }
  }
  for (auto _ : state) {
    const auto writer =
        open_point_writer(path, survey.header(), {.format = "copc", .replace = true});
    for (const PointBlock& block : blocks) writer->append(block);
    writer->finish();
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(point_count()));
  std::filesystem::remove(path);
}

void register_all() {
  benchmark::RegisterBenchmark("write/copc/las_format_6", write_octree)
      ->Unit(benchmark::kMillisecond);
  for (const Columns columns : {Columns::none, Columns::three, Columns::laser}) {
    for (const std::string format : {"xyz", "csv", "ply", "ply-ascii", "las", "laz"}) {
      const std::string of = format + (columns == Columns::none    ? ""
                                       : columns == Columns::three ? "/3_columns_more"
                                                                   : "/las_format_6");
      benchmark::RegisterBenchmark(("read/" + of).c_str(), read, format, columns)
          ->Unit(benchmark::kMillisecond);
      benchmark::RegisterBenchmark(("write/" + of).c_str(), write, format, columns)
          ->Unit(benchmark::kMillisecond);
    }
  }
}

}  // namespace
}  // namespace terrace::stream

int main(int argc, char** argv) {
  terrace::stream::register_all();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
