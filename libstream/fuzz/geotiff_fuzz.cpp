// SPDX-License-Identifier: Apache-2.0
// Any bytes as a GeoTIFF: an Error, or points within the raster and as many as announced at most.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"

namespace stream = terrace::stream;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = memfd_create("fuzz.tif", 0);
  if (file < 0 || write(file, data, size) != static_cast<ssize_t>(size)) std::abort();
  const std::string path = "/proc/self/fd/" + std::to_string(file);
  try {
    stream::RasterOptions raster;
    raster.memory_bytes = 4u << 20;
    stream::SourceOptions options;
    options.memory_bytes = 4u << 20;
    options.block_points = 1000;
    const auto source = stream::points_of(stream::open_geotiff(path, raster), options);
    const stream::SourceInfo& info = source->info();
    stream::PointBlock block;
    std::uint64_t points = 0;
    // Sparse and deflated files can be sound and very large: a part of them will do.
    for (int i = 0; i < 200 && source->next(block); ++i) {
      if (block.empty() || block.size() > options.block_points) std::abort();
      points += block.size();
      for (const stream::Point3& p : block.positions) {
        if (!(p[0] >= 0 && p[0] < static_cast<double>(info.columns) && p[1] >= 0 &&
              p[1] < static_cast<double>(info.rows))) {
          std::abort();
        }
      }
    }
    if (points > *info.points) std::abort();
  } catch (const stream::Error&) {
  }
  close(file);
  return 0;
}
