// SPDX-License-Identifier: GPL-3.0-or-later
#include "tile/make/tile_source.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/units.hpp"
#include "earth/geoid_heights.hpp"
#include "earth/store_crs.hpp"
#include "terrace/terrain/error.hpp"
#include "tile/make/point_tile_surface.hpp"
#include "tile/make/raster_tile_surface.hpp"

namespace terrace::terrain {
namespace {

/// What the triangles of a part may take of a thread, whatever --memory says.
constexpr std::uint64_t kLeastWindowBytes = std::uint64_t{64} << 20;

template <class Tiled, class Surface>
class SourceOf final : public TileSource {
 public:
  SourceOf(std::unique_ptr<Tiled> tiled, unsigned threads) : tiled_(std::move(tiled)) {
    for (unsigned i = 0; i < threads; ++i) {
      surfaces_.push_back(std::make_unique<Surface>(*tiled_));
    }
  }
  // They refer to what this class holds.
  ~SourceOf() override { surfaces_.clear(); }
  SourceOf(const SourceOf&) = delete;
  SourceOf& operator=(const SourceOf&) = delete;

 private:
  std::unique_ptr<Tiled> tiled_;
};

/// Metres of --fill; nothing: heights are taken from those around.
std::optional<double> flat_height(const stream::Store& store, const std::string& fill,
                                  double metres_per_unit) {
  if (fill == "interpolate") return std::nullopt;
  if (fill.starts_with("flat:")) return parse_number(fill.substr(5), "`fill` flat");
  if (fill != "flat") throw UsageError("`fill` '" + fill + "': interpolate, flat or flat:METRES");
  const stream::Channel& z = store.schema().coordinates[2];
  return (store.bounds().min[2] * z.scale + z.offset) * metres_per_unit;
}

std::optional<double> water_height(const stream::Store& store, const std::string& water) {
  if (water.empty()) return std::nullopt;
  if (water != "nodata") return parse_number(water, "`water`");
  if (!store.schema().grid) {
    throw UsageError(
        "`water` nodata is for rasters: irregular points have no cells without data; give the "
        "height of the water");
  }
  return std::nullopt;
}

}  // namespace

std::unique_ptr<TileSource> open_tile_source(const stream::Store& given,
                                             const TileSourceOptions& options,
                                             const Context& context) {
  const stream::Store store = given.with_stop(context.stop);
  const CoordinateSystem system = system_of(store);
  EllipsoidalHeights heights(store.schema(), options.vertical, options.geoid,
                             options.memory_bytes / 4, system.area());
  if (!heights.note().empty()) context.say(heights.note());
  if (!system.wgs84_note().empty()) context.say(system.wgs84_note());
  const std::optional<double> flat = flat_height(store, options.fill, heights.metres_per_unit());
  const std::optional<double> water = water_height(store, options.water);
  if (store.schema().grid) {
    auto raster = std::make_unique<TiledRaster>(store, system, std::move(heights));
    raster->flat_fill = flat;
    raster->water_height = water;
    return std::make_unique<SourceOf<TiledRaster, RasterTileSurface>>(std::move(raster),
                                                                      options.threads);
  }
  const std::uint64_t window =
      std::max(kLeastWindowBytes, options.memory_bytes / options.threads / 2);
  auto cloud = std::make_unique<TiledCloud>(store, system, std::move(heights), window,
                                            options.memory_bytes / 2, options.threads);
  cloud->flat_fill = flat;
  cloud->water_height = water;
  return std::make_unique<SourceOf<TiledCloud, PointTileSurface>>(std::move(cloud),
                                                                  options.threads);
}

}  // namespace terrace::terrain
