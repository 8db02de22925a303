// SPDX-License-Identifier: Apache-2.0
#include "fuzz_points.hpp"
#include "terrace/stream/raster.hpp"

/// Any bytes as a GeoTIFF: an Error, or points within the raster and as many as announced at most.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  const MemoryFile file(data, size);
  try {
    const RasterOptions raster{.memory_bytes = 4u << 20};
    const SourceOptions options{.block_points = 1000, .memory_bytes = 4u << 20};
    read_cells(*points_of(open_geotiff(file.name(), raster), options), options.block_points);
  } catch (const Error& error) {
    require(!error.parts().cause.empty(), "a cause");
  }
  return 0;
}
