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

/// A raster without georeferencing, with the cell size set by the caller.
class WithCells final : public Raster {
 public:
  WithCells(std::unique_ptr<Raster> raster, double cell) : raster_(std::move(raster)) {
    info_ = raster_->info();
    if (info_.world != kPlainWorld) {
      throw Error(info_.files.front(), "is georeferenced, which sets its cell size")
          .remedy(message("leave {cell} out"));
    }
    std::erase(info_.comments, kNoGeoreferencing);
    for (double& number : info_.world.xy) number *= cell;
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
  RasterOptions raster{.band = options.band,
                       .memory_bytes = options.memory_bytes,
                       .heights_of_colour = options.heights_of_colour};
  const std::uint64_t window = window_bytes(options.memory_bytes);
  raster.cache_bytes = window / 6;
  const auto open_one = [open, cell = options.cell](const std::string& file,
                                                    const RasterOptions& one) {
    std::unique_ptr<Raster> found = open_with_aux_xml(open, file, one);
    if (cell > 0) found = std::make_unique<WithCells>(std::move(found), cell);
    return found;
  };
  if (files.size() == 1) return points_of(open_one(files.front(), raster), options);
  constexpr std::size_t kOpenAtOnce = 32;
  raster.cache_bytes /= kOpenAtOnce / 4;  // few of them overlap one window
  const RasterOpener opener = [raster, open_one](const std::string& file) {
    return open_one(file, raster);
  };
  return points_of(open_mosaic({files.begin(), files.end()}, opener, options.crs, kOpenAtOnce,
                               options.memory_bytes - window, options.same_crs),
                   options);
}

}  // namespace terrace::stream
