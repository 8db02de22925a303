// SPDX-License-Identifier: Apache-2.0
#include "format/raster_points.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "format/sidecars.hpp"
#include "raster/order.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// Gives a raster without georeferencing the caller's cell size.
class RasterWithCellSize final : public Raster {
 public:
  RasterWithCellSize(std::unique_ptr<Raster> raster, double cell) : raster_(std::move(raster)) {
    info_ = raster_->info();
    if (info_.world != kPlainWorld) {
      throw Error(info_.files.front(), "is georeferenced, so its cell size is known")
          .remedy(message("leave {cell} out"));
    }
    std::erase(info_.comments, kNoGeoreferencing);
    for (double& coefficient : info_.world.xy) coefficient *= cell;
  }

  [[nodiscard]] const RasterInfo& info() const override { return info_; }
  bool read_over(const CellWindow& window, const CellBuffer& out) override {
    return raster_->read_over(window, out);
  }
  void set_open_bytes(std::uint64_t bytes) override { raster_->set_open_bytes(bytes); }

 private:
  std::unique_ptr<Raster> raster_;
  RasterInfo info_;
};

}  // namespace

std::unique_ptr<PointSource> open_raster_points(std::span<const std::string> files,
                                                const SourceOptions& options,
                                                const OpenRaster& open) {
  RasterOptions raster_options{.band = options.band,
                               .memory_bytes = options.memory_bytes,
                               .heights_of_colour = options.heights_of_colour};
  const std::uint64_t window = window_bytes(options.memory_bytes);
  // A sixth of the window's memory caches decoded blocks.
  raster_options.cache_bytes = window / 6;
  const auto open_one = [open, cell = options.cell](const std::string& file,
                                                    const RasterOptions& file_options) {
    std::unique_ptr<Raster> raster = open_with_aux_xml(open, file, file_options);
    if (cell > 0) raster = std::make_unique<RasterWithCellSize>(std::move(raster), cell);
    return raster;
  };
  if (files.size() == 1) return points_of(open_one(files.front(), raster_options), options);
  constexpr std::size_t kOpenAtOnce = 32;
  constexpr std::size_t kMaxOverlaps = 4;  // about as many open files overlap one window
  raster_options.cache_bytes /= kOpenAtOnce / kMaxOverlaps;
  const RasterOpener opener = [raster_options, open_one](const std::string& file) {
    return open_one(file, raster_options);
  };
  return points_of(open_mosaic({files.begin(), files.end()}, opener, options.crs, kOpenAtOnce,
                               options.memory_bytes - window, options.same_crs),
                   options);
}

}  // namespace terrace::stream
