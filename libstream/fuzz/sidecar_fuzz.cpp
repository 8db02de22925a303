// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "fuzz_points.hpp"

namespace terrace::stream {
namespace {

/// Returns a little-endian TIFF of 2 x 2 bytes without georeferencing.
std::string small_tiff() {
  std::string bytes("II*\0\x0c\0\0\0\1\2\3\4", 12);
  const std::array<std::pair<int, int>, 9> fields{
      {{256, 2}, {257, 2}, {258, 8}, {259, 1}, {262, 1}, {273, 8}, {277, 1}, {278, 2}, {279, 4}}};
  bytes += {static_cast<char>(fields.size()), '\0'};
  for (const auto& [tag, value] : fields) {
    // Adds a field of one 16-bit number.
    bytes += {static_cast<char>(tag & 255),
              static_cast<char>(tag >> 8),
              3,
              0,
              1,
              0,
              0,
              0,
              static_cast<char>(value),
              0,
              0,
              0};
  }
  return bytes + std::string(4, '\0');
}

class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "terrace-fuzz-XXXXXX").string();
    require(mkdtemp(name.data()) != nullptr, "a folder can be created");
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string put(const std::string& name, std::string_view bytes) const {
    const std::string file = (path_ / name).string();
    std::ofstream(file, std::ios::binary)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return file;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace
}  // namespace terrace::stream

/// A raster with any input as its world file, and as its .aux.xml, is refused, or its cells have
/// finite places and heights.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const char* const sidecar : {"a.tfw", "a.tif.aux.xml"}) {
    const Folder folder;
    const std::string file = folder.put("a.tif", small_tiff());
    folder.put(sidecar, text);
    read_all_points(file, {.block_points = 3, .memory_bytes = 4u << 20});
    try {
      const auto source = open_source(std::span(&file, 1));
      const SourceInfo& info = source->info();
      for (const double number : info.world.xy) require(std::isfinite(number), "places are finite");
      const Channel& height = info.coordinates[2];
      require(std::isfinite(height.scale) && height.scale != 0, "the scale is finite and not 0");
      require(std::isfinite(height.offset), "the offset is finite");
    } catch (const Error&) {
      // The raster is refused.
    }
  }
  return 0;
}
