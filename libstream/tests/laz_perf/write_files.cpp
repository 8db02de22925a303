// SPDX-License-Identifier: Apache-2.0
// write_files FOLDER: LAZ files of made scans, NAME.laz, and their records, NAME.records.
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>

#include "../laz_testing.hpp"
#include "terrace/stream/laz.hpp"

int main(int argc, char** argv) {
  using namespace terrace::stream::laz;
  if (argc != 2) return 2;
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
