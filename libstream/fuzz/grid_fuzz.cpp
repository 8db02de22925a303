// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <string_view>
#include <vector>

#include "format/grid/binary.hpp"
#include "format/grid/rasters.hpp"
#include "fuzz_points.hpp"
#include "terrace/stream/raster.hpp"

namespace terrace::stream {
namespace {

template <class Open>
void read_or_refuse(Open&& open) {
  const SourceOptions options{.block_points = 1000, .memory_bytes = 4u << 20};
  try {
    read_cells(*points_of(open(), options), options.block_points);
  } catch (const Error& error) {
    require(!error.parts().cause.empty(), "errors have a cause");
  }
}

/// A file with the name of an HGT tile.
class TileFile {
 public:
  TileFile(const std::uint8_t* data, std::size_t size) {
    std::string folder = (std::filesystem::temp_directory_path() / "terrace-fuzz-XXXXXX").string();
    require(mkdtemp(folder.data()) != nullptr, "a folder can be created");
    folder_ = folder;
    std::ofstream(name(), std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  }
  ~TileFile() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  TileFile(const TileFile&) = delete;
  TileFile& operator=(const TileFile&) = delete;

  [[nodiscard]] std::string name() const { return (folder_ / "N46E008.hgt").string(); }

 private:
  std::filesystem::path folder_;
};

}  // namespace
}  // namespace terrace::stream

/// Any input is refused, or gives points inside the grid, in each of the grid formats. For a binary
/// grid the input is both header and samples.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  const MemoryFile file(data, size);
  const RasterOptions plain{.memory_bytes = 4u << 20};
  read_or_refuse([&] { return open_ascii_grid(file.name()); });
  read_or_refuse([&] { return open_usgs_dem(file.name()); });
  read_or_refuse([&] { return open_height_map(file.name(), plain); });
  for (const HeightsOfColour colours : {HeightsOfColour::mapbox, HeightsOfColour::terrarium}) {
    read_or_refuse([&] {
      return open_height_map(file.name(), {.memory_bytes = 4u << 20, .heights_of_colour = colours});
    });
  }
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto* const bytes = reinterpret_cast<const std::byte*>(data);
  for (const bool floats : {false, true}) {
    read_or_refuse([&] {
      const GridHeader header = read_binary_header("header", text);
      return open_plain_grid(describe_binary_grid("grid", header, floats, 1),
                             bytes_in_memory("grid", {bytes, bytes + size}));
    });
  }
  // Other data than archives is a tile only if its size is right, so large input is skipped.
  if (text.starts_with("PK") || text.starts_with("\x1f\x8b") || size < 1000) {
    const TileFile tile(data, size);
    read_or_refuse([&] { return open_hgt(tile.name()); });
  }
  return 0;
}
