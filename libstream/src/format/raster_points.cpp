// SPDX-License-Identifier: Apache-2.0
#include "format/raster_points.hpp"

#include <cstddef>
#include <cstdint>

#include "raster/order.hpp"

namespace terrace::stream {

std::unique_ptr<PointSource> open_raster_points(std::span<const std::string> files,
                                                const SourceOptions& options,
                                                const OpenRaster& open) {
  RasterOptions raster{.band = options.band,
                       .memory_bytes = options.memory_bytes,
                       .heights_of_colour = options.heights_of_colour};
  const std::uint64_t window = window_bytes(options.memory_bytes);
  raster.cache_bytes = window / 6;
  if (files.size() == 1) return points_of(open(files.front(), raster), options);
  constexpr std::size_t kOpenAtOnce = 32;
  raster.cache_bytes /= kOpenAtOnce / 4;  // few of them meet in one window
  const RasterOpener opener = [raster, open](const std::string& file) {
    return open(file, raster);
  };
  return points_of(open_mosaic({files.begin(), files.end()}, opener, options.crs.has_value(),
                               kOpenAtOnce, options.memory_bytes - window),
                   options);
}

}  // namespace terrace::stream
