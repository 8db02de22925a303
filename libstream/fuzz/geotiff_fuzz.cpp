// SPDX-License-Identifier: Apache-2.0
#include "fuzz_points.hpp"
#include "terrace/stream/raster.hpp"

/// Any input is refused as a GeoTIFF, or gives points inside the raster, at most as many as
/// announced. The same holds for a region of it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  const MemoryFile file(data, size);
  try {
    const RasterOptions raster{.memory_bytes = 4u << 20};
    SourceOptions options{.block_points = 1000, .memory_bytes = 4u << 20};
    const auto raster_points = points_of(open_geotiff(file.name(), raster), options);
    const SourceInfo& info = raster_points->info();
    const auto columns = static_cast<double>(info.columns), rows = static_cast<double>(info.rows);
    options.selection.region =
        world_box(info, {{columns / 3, rows / 3, 0}, {columns / 2, rows / 2, 0}});
    const auto part = points_of(open_geotiff(file.name(), raster), options);
    const std::uint64_t cells = info.columns * info.rows;
    require(*part->info().points + part->progress().excluded == cells, "all cells are counted");
    read_cells(*part, options.block_points);
    read_cells(*raster_points, options.block_points);
  } catch (const Error& error) {
    require(!error.parts().cause.empty(), "errors have a cause");
  }
  return 0;
}
