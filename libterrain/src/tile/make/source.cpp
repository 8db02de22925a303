// SPDX-License-Identifier: Apache-2.0
#include "tile/make/source.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>

#include "base/units.hpp"
#include "earth/geoid_heights.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/error.hpp"
#include "tile/make/point_surface.hpp"
#include "tile/make/raster_surface.hpp"

namespace terrace::terrain {
namespace {

/// Memory of a thread: the samples of a leaf or of a part of a tile, their mesh and its caches.
constexpr std::uint64_t kBytesPerThread = std::uint64_t{96} << 20;
/// Memory of the store's fill and blocks, and of the lists of tiles.
constexpr std::uint64_t kTilingFixedBytes = std::uint64_t{80} << 20;
/// The least memory for the triangles of a part.
constexpr std::uint64_t kMinWindowBytes = std::uint64_t{64} << 20;

/// The largest height that is accepted, in metres above or below the ellipsoid.
constexpr double kFarthestStored = 1e7;

template <class Tiled, class Surface>
class SourceOf final : public TileSource {
 public:
  SourceOf(std::unique_ptr<Tiled> tiled, unsigned threads) : tiled_(std::move(tiled)) {
    for (unsigned i = 0; i < threads; ++i) {
      surfaces_.push_back(std::make_unique<Surface>(*tiled_));
    }
  }
  // The surfaces refer to members of this class.
  ~SourceOf() override { surfaces_.clear(); }
  SourceOf(const SourceOf&) = delete;
  SourceOf& operator=(const SourceOf&) = delete;

 private:
  std::unique_ptr<Tiled> tiled_;
};

/// Returns the flat fill in metres above the ellipsoid; nullopt if heights are interpolated from
/// surrounding heights.
std::optional<double> flat_height(const stream::Store& store, const TilesRequest& request,
                                  double metres_per_unit) {
  if (request.fill == Fill::none) {
    throw UsageError(stream::message("{fill} none: globes have no holes"));
  }
  if (request.fill == Fill::interpolate) return std::nullopt;
  if (request.flat_height && !(std::abs(*request.flat_height) <= kFarthestStored)) {
    throw UsageError(stream::message("{fill} flat: the height is beyond the limit of 10,000 km"));
  }
  const stream::Channel& z = store.schema().coordinates[2];
  const double lowest = (store.bounds().min[2] * z.scale + z.offset) * metres_per_unit;
  return request.flat_height.value_or(lowest);
}

/// metres: metres per unit of the store's heights.
void check_heights(const stream::Store& store, double metres) {
  const stream::Channel& z = store.schema().coordinates[2];
  for (const stream::Point3& end : {store.bounds().min, store.bounds().max}) {
    const double height = (end[2] * z.scale + z.offset) * metres;
    if (std::abs(height) <= kFarthestStored) continue;
    throw stream::Error(
        store.path().string(),
        fmt::format("has heights of {} m, beyond the limit of 10,000 km", plain_number(height)))
        .remedy(stream::message("check the unit and the nodata value of the source, or leave "
                                "wrong heights out: {where} 'z < 9000'"));
  }
}

}  // namespace

TileResources tile_resources(const Context& context, const std::string& path) {
  const std::uint64_t memory = context.memory_or(0);
  if (memory < kTilingFixedBytes + kBytesPerThread) {
    throw stream::Error(path,
                        stream::message("tiles need {}M of memory, {memory_bytes} allows {}M",
                                        (kTilingFixedBytes + kBytesPerThread) >> 20, memory >> 20))
        .remedy("allow more");
  }
  const std::uint64_t threads = (memory - kTilingFixedBytes) / kBytesPerThread;
  return {memory, static_cast<unsigned>(std::min<std::uint64_t>(context.threads, threads))};
}

std::unique_ptr<TileSource> open_tile_source(const stream::Store& input,
                                             const TilesRequest& request,
                                             const TileResources& resources,
                                             const Context& context) {
  if (request.water && !request.water_height && !input.schema().grid) {
    throw UsageError(stream::message(
        "{water} nodata is for rasters: irregular points have no cells without data; give the "
        "height of the water"));
  }
  const stream::Store store = input.with_stop(context.stop);
  const CoordinateSystem system = system_of(store);
  EllipsoidalHeights heights(store.schema(), request.vertical, request.geoid,
                             resources.memory_bytes / 4, system.area());
  check_heights(store, heights.metres_per_unit());
  if (!heights.note().empty()) context.say(heights.note());
  if (!system.wgs84_note().empty()) context.say(system.wgs84_note());
  const std::optional<double> flat = flat_height(store, request, heights.metres_per_unit());
  const auto with_options = [&](TiledStore& tiled) {
    tiled.flat_fill = flat;
    tiled.water_height = request.water_height;
  };
  if (store.schema().grid) {
    auto raster =
        std::make_unique<TiledRaster>(store, system, std::move(heights), resources.threads);
    with_options(*raster);
    return std::make_unique<SourceOf<TiledRaster, RasterTileSurface>>(std::move(raster),
                                                                      resources.threads);
  }
  const std::uint64_t window =
      std::max(kMinWindowBytes, resources.memory_bytes / resources.threads / 2);
  auto cloud = std::make_unique<TiledCloud>(store, system, std::move(heights), window,
                                            resources.memory_bytes / 2, resources.threads);
  with_options(*cloud);
  return std::make_unique<SourceOf<TiledCloud, PointTileSurface>>(std::move(cloud),
                                                                  resources.threads);
}

}  // namespace terrace::terrain
