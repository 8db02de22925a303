// SPDX-License-Identifier: Apache-2.0
// write_files FOLDER OCTREES writes to FOLDER LAZ files of synthetic scans, NAME.laz, and their
// records, NAME.records, and to OCTREES COPC, NAME.copc.laz, and the same points as NAME.las.
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <span>
#include <string>

#include "../laz_testing.hpp"
#include "../point_files.hpp"
#include "format/writers.hpp"
#include "terrace/stream/laz.hpp"
#include "terrace/stream/point_writer.hpp"

namespace {

/// Writes a wavy surface with the attributes of a point format to a file. The ending determines the
/// format, and COPC gets a given number of nodes per page.
void write_scan(const std::filesystem::path& file, unsigned format, std::size_t points,
                std::size_t page_nodes = 0) {
  using namespace terrace::stream;
  PointHeader header;
  header.attributes = {{.name = "intensity", .type = ScalarType::u16},
                       {.name = "scan_angle", .type = ScalarType::i16, .scale = 0.006},
                       {.name = "gps_time", .type = ScalarType::f64},
                       {.name = "own", .type = ScalarType::f32}};
  constexpr std::array kBands{"red", "green", "blue", "nir"};
  const unsigned bands = format == 6 ? 0 : format - 4;
  for (unsigned band = 0; band < bands; ++band) {
    header.attributes.push_back({.name = kBands[band], .type = ScalarType::u16});
  }
  header.crs = [] {
    Crs crs;
    crs.wkt = "LOCAL_CS[\"made\"]";
    return crs;
  };
  header.lattice = Lattice{.scale = {0.01, 0.01, 0.01}, .offset = {500'000, 5'000'000, 0}};
  const auto writer =
      page_nodes > 0 ? open_paged_copc_writer(file.string(), header, {.replace = true}, page_nodes)
                     : open_point_writer(file.string(), header, {.replace = true});
  std::mt19937_64 random(format);
  PointBlock block;
  for (std::size_t i = 0; i < points; ++i) {
    const auto x = static_cast<double>(random() % 100'000), y = static_cast<double>(i % 50'000),
               z = static_cast<double>(random() % 999);
    block.positions.push_back({500'000 + 0.01 * x, 5'000'000 + 0.01 * y, 0.05 * z});
    append_values(block.payload, static_cast<std::uint16_t>(x / 2),
                  static_cast<std::int16_t>(x / 10 - 5000), 1e8 + 0.001 * static_cast<double>(i),
                  static_cast<float>(y / 3));
    for (unsigned band = 0; band < bands; ++band) {
      append_values(block.payload, static_cast<std::uint16_t>(random()));
    }
  }
  writer->append(block);
  writer->finish();
}

}  // namespace

int main(int argc, char** argv) {
  using namespace terrace::stream::laz;
  if (argc != 3) return 2;
  for (const unsigned format : {6u, 7u, 8u}) {
    const std::string path = argv[2] + std::string("/format") + std::to_string(format);
    write_scan(path + ".copc.laz", format, 100'000);
    write_scan(path + ".las", format, 100'000);
  }
  // Each of its few nodes has a separate page.
  write_scan(argv[2] + std::string("/pages.copc.laz"), 6, 100'000, 4);
  write_scan(argv[2] + std::string("/pages.las"), 6, 100'000);
  const std::filesystem::path folder(argv[1]);
  const auto write = [](const std::filesystem::path& path, std::span<const std::byte> bytes) {
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    return file.good();
  };
  for (const unsigned format : {0u, 1u, 2u, 3u, 6u, 7u, 8u}) {
    for (const std::size_t extra : {0u, 5u}) {
      const std::size_t length = kRecordLengths[format] + extra;
      const ByteVector records = scanned_records(format, length, 2500);
      const std::string name = "format" + std::to_string(format) + "_" + std::to_string(extra);
      const bool written = write(folder / (name + ".laz"),
                                 laz_file(format, Vlr::of(format, length, 1000), records)) &&
                           write(folder / (name + ".records"), records);
      if (!written) return 1;
    }
  }
}
