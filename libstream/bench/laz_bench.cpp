// SPDX-License-Identifier: Apache-2.0
// Measures decoding and encoding of LAZ on one core, in memory, with synthetic scans of some
// formats and with the files in TERRACE_DATA if it is set. Items are points, bytes are those of the
// records.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include <benchmark/benchmark.h>

#include "../tests/laz_testing.hpp"
#include "terrace/stream/laz.hpp"

namespace terrace::stream::laz {
namespace {

void set_processed(benchmark::State& state, const LazFile& file) {
  const auto points = state.iterations() * static_cast<std::int64_t>(file.points);
  state.SetItemsProcessed(points);
  state.SetBytesProcessed(points * static_cast<std::int64_t>(file.vlr.record_length()));
}

void decode(benchmark::State& state, const LazFile& file, std::uint32_t attributes) {
  Decoder decoder(file.vlr, attributes);
  const std::size_t length = file.vlr.record_length();
  ByteVector records;
  for (auto _ : state) {
    for (const Chunk& chunk : file.chunks) {
      records.resize(chunk.points * length);
      decoder.decode_chunk(file.chunk(chunk), records);
      benchmark::DoNotOptimize(records.data());
    }
  }
  set_processed(state, file);
}

void encode(benchmark::State& state, const LazFile& file) {
  Decoder decoder(file.vlr);
  std::vector<ByteVector> chunks;
  for (const Chunk& chunk : file.chunks) {
    chunks.emplace_back(chunk.points * file.vlr.record_length());
    decoder.decode_chunk(file.chunk(chunk), chunks.back());
  }
  Encoder encoder(file.vlr);
  ByteVector out;
  for (auto _ : state) {
    for (const ByteVector& records : chunks) {
      out.clear();
      encoder.encode_chunk(records, out);
      benchmark::DoNotOptimize(out.data());
    }
  }
  set_processed(state, file);
}

void register_file(const std::string& name, ByteVector bytes) {
  const auto file = std::make_shared<const LazFile>(std::move(bytes));
  const auto add = [&name](const std::string& what, auto run) {
    benchmark::RegisterBenchmark((what + "/" + name).c_str(), run)->Unit(benchmark::kMillisecond);
  };
  add("decode", [file](benchmark::State& state) { decode(state, *file, kAllAttributes); });
  if (file->vlr.compressor == Compressor::layered) {
    add("decode_xyz", [file](benchmark::State& state) { decode(state, *file, kZ); });
  }
  add("encode", [file](benchmark::State& state) { encode(state, *file); });
}

void register_all() {
  const bool small = std::getenv("TERRACE_BENCH_SMALL") != nullptr;
  for (const unsigned format : {1u, 3u, 6u, 7u}) {
    const std::size_t length = kRecordLengths[format];
    register_file("made_format_" + std::to_string(format),
                  laz_file(format, Vlr::of(format, length),
                           scanned_records(format, length, small ? 2000 : 200'000)));
  }
  const char* data = std::getenv("TERRACE_DATA");
  if (data == nullptr || small) return;
  for (const char* name :
       {"autzen_trim.laz", "lidR_Topography.laz", "ept-lone-star/ept-data/2-2-2-1.laz",
        "coromandel_points.laz", "las_with_several_extra_byte_bloc.laz", "lone-star.copc.laz"}) {
    const auto path = std::filesystem::path(data) / "lidar" / name;
    if (std::filesystem::exists(path)) register_file(name, read_bytes(path));
  }
}

}  // namespace
}  // namespace terrace::stream::laz

int main(int argc, char** argv) {
  terrace::stream::laz::register_all();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
