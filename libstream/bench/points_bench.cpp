// SPDX-License-Identifier: Apache-2.0
// Reading and writing files of points, warm: survey coordinates (millimetres in a UTM zone), and
// the same with three more columns. Items are points.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>

#include <benchmark/benchmark.h>
#include <unistd.h>

#include "terrace/stream/point_writer.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {
namespace {

std::size_t point_count() {
  return std::getenv("TERRACE_BENCH_SMALL") != nullptr ? 20'000 : 2'000'000;
}

/// Points of a survey in blocks of 10,000, the last shorter.
class Survey {
 public:
  explicit Survey(bool columns) : random_(1) {
    if (!columns) return;
    header_.attributes = {{.name = "intensity", .type = ScalarType::u16},
                          {.name = "class", .type = ScalarType::u8},
                          {.name = "confidence", .type = ScalarType::f32}};
  }
  [[nodiscard]] const PointHeader& header() const { return header_; }

  void write(const std::string& path, const std::string& format) {
    const auto writer = open_point_writer(path, header_, {.format = format, .replace = true});
    for (std::size_t left = point_count(); left > 0;) {
      const PointBlock& block = make(std::min<std::size_t>(left, 10'000));
      writer->append(block);
      left -= block.size();
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
        const std::uint64_t bits = random_();
        const auto bytes = channel.type == ScalarType::f32
                               ? std::as_bytes(std::span(&confidence, 1))
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

void read(benchmark::State& state, const std::string& format, bool columns) {
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

/// Without the syncs, which would measure the disk: the file is given up after its last point.
void write(benchmark::State& state, const std::string& format, bool columns) {
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

void register_all() {
  for (const bool columns : {false, true}) {
    for (const std::string format : {"xyz", "csv", "ply", "ply-ascii"}) {
      const std::string of = format + (columns ? "/3_columns_more" : "");
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
