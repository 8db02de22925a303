// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/random.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/geotiff_writer.hpp>
#include <terrace/stream/store.hpp>

#include "base/parallel.hpp"
#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "tile/format/quantized_mesh.hpp"
#include "tile/make/height_blocks.hpp"
#include "tile/make/mesher.hpp"
#include "tile/make/raster_surface.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

class RasterOfDegrees : public ::testing::Test {
 protected:
  static constexpr std::int64_t kColumns = 700, kRows = 290;
  static constexpr double kNodata = -9999.0;

  double random() {
    seed_ = base::splitmix64(seed_);
    return base::unit_interval(seed_);
  }

  template <class T>
  stream::Store make(stream::ScalarType type, const std::array<double, 6>& world, int epsg,
                     double gaps = 0.1) {
    std::vector<T> heights;
    for (std::int64_t i = 0; i < kColumns * kRows; ++i) {
      const double slope = 2800.0 * static_cast<double>(i) / (kColumns * kRows);
      heights.push_back(static_cast<T>(random() < gaps ? kNodata : slope + 200 * random()));
    }
    stream::GeoTiffOptions tiff;
    tiff.columns = kColumns;
    tiff.rows = kRows;
    tiff.sample.name = "height";
    tiff.sample.type = type;
    tiff.world.xy = world;
    tiff.nodata = kNodata;
    tiff.replace = true;
    tiff.crs.epsg = epsg;
    tiff.crs.geographic = epsg == 4326;
    stream::GeoTiffWriter writer(folder_ / "dem.tif", tiff);
    writer.write_rows(std::as_bytes(std::span(heights)));
    writer.commit();
    BuildRequest request;
    request.inputs = {(folder_ / "dem.tif").string()};
    request.store = folder_ / "dem.terrace";
    request.replace = true;
    build_store(request);
    return stream::Store::open(folder_ / "dem.terrace");
  }

  std::uint64_t seed_ = 23;
  tests::TemporaryFolder scratch_;
  const fs::path& folder_ = scratch_.path();
};

using Heights = std::map<std::pair<double, double>, double>;

Heights sampled(TileSurface& surface, const GeographicBox& box) {
  SurfaceSamples samples;
  surface.samples(box, samples);
  Heights heights;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    heights[{samples.longitude[i], samples.latitude[i]}] = samples.height[i];
  }
  EXPECT_EQ(heights.size(), samples.size());
  return heights;
}

Heights in_rows(const SurfaceRows& rows) {
  EXPECT_TRUE(std::is_sorted(rows.longitude.begin(), rows.longitude.end()));
  EXPECT_TRUE(std::is_sorted(rows.latitude.begin(), rows.latitude.end()));
  EXPECT_EQ(rows.height.size(), rows.longitude.size() * rows.latitude.size());
  Heights heights;
  for (std::size_t i = 0; i < rows.height.size(); ++i) {
    if (std::isnan(rows.height[i])) continue;
    heights[{rows.longitude[i % rows.longitude.size()], rows.latitude[i / rows.longitude.size()]}] =
        rows.height[i];
  }
  return heights;
}

TEST_F(RasterOfDegrees, RowsMatchSamples) {
  const std::array<std::array<double, 6>, 5> worlds{{{0.01, 0, 10, 0, -0.01, 47},
                                                     {0.01, 0, 10, 0, 0.01, 44},
                                                     {-0.01, 0, 17, 0, -0.01, 47},
                                                     {0.01, 0, 176, 0, -0.01, -20},
                                                     {0.5, 0, 5, 0, -0.5, 72}}};
  for (const auto& world : worlds) {
    const stream::Store store = make<float>(stream::ScalarType::f32, world, 4326);
    TiledRaster raster(store, CoordinateSystem::of(store.schema().crs, "test").value(),
                       {store.schema(), HeightReference::ignore, "", 1 << 20}, 2);
    for (const bool flat : {false, true}) {
      if (flat) raster.flat_fill = 12.0;
      RasterTileSurface surface(raster), other(raster);
      std::size_t samples = 0;
      int in_a_row = 0;
      const GeographicBox all = surface.bounds();
      for (int round = 0; round < 60; ++round) {
        const double west = all.west + (all.east - all.west) * random();
        const double south = all.south + (all.north - all.south) * random();
        const double size = std::abs(world[0]) * (2 + 150 * random() * random());
        const GeographicBox box{west - 0.5 * size, south - 0.5 * size, west + size, south + size};
        SCOPED_TRACE(testing::Message() << "from " << world[2] << " by " << world[0] << ", round "
                                        << round << ": " << box.west << "," << box.south);
        const SurfacePart part = surface.part(box);
        const auto* const rows = std::get_if<SurfaceRows>(&part);
        if (rows == nullptr) continue;
        ++in_a_row;
        const Heights expected = sampled(other, box);
        EXPECT_EQ(in_rows(*rows), expected);
        samples += expected.size();
      }
      EXPECT_GT(in_a_row, 40);
      EXPECT_GT(samples, 100u);
    }
  }
}

/// A surface with an unknown range.
class WithoutRange final : public RasterTileSurface {
 public:
  using RasterTileSurface::RasterTileSurface;
  std::optional<HeightRange> surface_range(const GeographicBox& /*box*/) override { return {}; }
};

TEST_F(RasterOfDegrees, SurfaceIsWithinItsRange) {
  for (const auto& [world, epsg] :
       {std::pair{std::array<double, 6>{0.01, 0, 10, 0, -0.01, 47}, 4326},
        std::pair{std::array<double, 6>{0.01, 0, 176, 0, -0.01, -20}, 4326},
        std::pair{std::array<double, 6>{30, 0, 400000, 0, -30, 5200000}, 32632},
        std::pair{std::array<double, 6>{21, 21, 400000, 21, -21, 5200000}, 32632}}) {
    for (const double gaps : {0.0, 0.001}) {
      const stream::Store store = make<float>(stream::ScalarType::f32, world, epsg, gaps);
      TiledRaster raster(store, CoordinateSystem::of(store.schema().crs, "test").value(),
                         {store.schema(), HeightReference::ignore, "", 1 << 20}, 2);
      for (const bool flat : {false, true}) {
        if (flat) raster.flat_fill = -50.0;
        RasterTileSurface surface(raster);
        const GeographicBox all = surface.bounds();
        const double low = raster.everywhere.low, high = raster.everywhere.high;
        unsigned narrower = 0;
        for (int round = 0; round < 100; ++round) {
          const double west = all.west + (all.east - all.west) * (1.2 * random() - 0.1);
          const double south = all.south + (all.north - all.south) * (1.2 * random() - 0.1);
          const double size = surface.spacing() * (1 + 90 * random() * random());
          const GeographicBox box{west, south, west + size, south + size};
          SCOPED_TRACE(testing::Message() << "EPSG:" << epsg << ", gaps " << gaps << ", round "
                                          << round << ": " << west << "," << south);
          const HeightRange range = surface.surface_range(box).value();
          narrower += range.low > low || range.high < high ? 1 : 0;
          std::vector<double> longitude, latitude;
          for (int k = 0; k < 50; ++k) {
            longitude.push_back(wrapped_longitude(west + size * random()));
            latitude.push_back(south + size * random());
          }
          std::vector<double> heights(longitude.size());
          surface.heights(longitude, latitude, heights);
          for (const auto& [place, height] : sampled(surface, box)) heights.push_back(height);
          for (const double height : heights) {
            EXPECT_GE(height, range.low - 1e-9);
            EXPECT_LE(height, range.high + 1e-9);
          }
        }
        // Across 180 degrees, bounds go around the globe.
        if (gaps == 0.0 && all.east - all.west < 180.0) {
          EXPECT_GT(narrower, 20U);
        }
      }
    }
  }
}

TEST_F(RasterOfDegrees, TilesDoNotDependOnKnownRange) {
  for (const auto& [world, epsg] :
       {std::pair{std::array<double, 6>{0.01, 0, 10, 0, -0.01, 47}, 4326},
        std::pair{std::array<double, 6>{30, 0, 400000, 0, -30, 5200000}, 32632}}) {
    for (const double gaps : {0.0, 0.001}) {
      const stream::Store store = make<float>(stream::ScalarType::f32, world, epsg, gaps);
      const TiledRaster raster(store, CoordinateSystem::of(store.schema().crs, "test").value(),
                               {store.schema(), HeightReference::ignore, "", 1 << 20}, 2);
      RasterTileSurface known(raster);
      WithoutRange unknown(raster);
      for (const unsigned zoom : {2U, 5U, 7U, 9U, 10U}) {
        for (const double bound : {30000.0, 4200.0, 900.0}) {
          const ZoomPlan plan = plan_zoom(zoom, bound, 3000, known);
          const TileRange tiles = tiles_in(known.bounds(), zoom);
          const TileAddress tile{zoom, (tiles.x0 + tiles.x1) / 2, (tiles.y0 + tiles.y1) / 2};
          SCOPED_TRACE(testing::Message() << tile_path(tile) << ", bound " << bound);
          const BuiltTile made = make_tile(tile, plan, known, {});
          const BuiltTile same = make_tile(tile, plan, unknown, {});
          EXPECT_EQ(encode_tile(made.mesh, made.header), encode_tile(same.mesh, same.header));
          EXPECT_EQ(made.max_error, same.max_error);
        }
      }
    }
  }
}

TEST_F(RasterOfDegrees, ProjectedOrRotatedRastersHaveNoRows) {
  for (const auto& [world, epsg] :
       {std::pair{std::array<double, 6>{30, 0, 400000, 0, -30, 5200000}, 32632},
        std::pair{std::array<double, 6>{0.01, 0.001, 10, -0.001, 0.01, 44}, 4326}}) {
    const stream::Store store = make<float>(stream::ScalarType::f32, world, epsg);
    const TiledRaster raster(store, CoordinateSystem::of(store.schema().crs, "test").value(),
                             {store.schema(), HeightReference::ignore, "", 1 << 20}, 2);
    RasterTileSurface surface(raster);
    EXPECT_TRUE(std::holds_alternative<SurfaceGrid>(surface.part(surface.bounds())));
  }
}

TEST_F(RasterOfDegrees, BoxesOfProjectedRastersHaveAllSamples) {
  const double around = 2 * 20037508.342789244 / kColumns;
  for (const auto& [world, epsg] :
       {std::pair{std::array<double, 6>{30000, 0, -1e7, 0, -30000, 8e6}, 32632},
        std::pair{std::array<double, 6>{10000, 500, 3e6, 500, -10000, 4e6}, 3035},
        std::pair{std::array<double, 6>{around, 0, -20037508, 0, -around, 8e6}, 3857}}) {
    const stream::Store store = make<float>(stream::ScalarType::f32, world, epsg, 0.0);
    const TiledRaster raster(store, CoordinateSystem::of(store.schema().crs, "test").value(),
                             {store.schema(), HeightReference::ignore, "", 1 << 20}, 2);
    std::vector<Point2> places;
    for (std::int64_t i = 0; i < kColumns * kRows; ++i) {
      places.push_back({static_cast<double>(i % kColumns), static_cast<double>(i / kColumns)});
    }
    raster.places.to_geographic(places);
    RasterTileSurface surface(raster);
    const GeographicBox all = surface.bounds();
    for (int round = 0; round < 60; ++round) {
      const double west = all.west + (all.east - all.west) * random();
      const double south = all.south + (all.north - all.south) * random();
      const double size = 9 * random();
      const GeographicBox box{west, south, west + size, south + size * (0.01 + random())};
      SurfaceSamples found;
      surface.samples(box, found);
      const auto inside = [&](const Point2& p) {
        return p[0] >= box.west && p[0] <= box.east && p[1] >= box.south && p[1] <= box.north;
      };
      EXPECT_EQ(found.size(), std::count_if(places.begin(), places.end(), inside))
          << epsg << ": " << box.west << "," << box.south << " of " << size;
    }
  }
}

TEST_F(RasterOfDegrees, SurfacesShareCachedHeights) {
  std::stop_source stop;
  const stream::Store store =
      make<float>(stream::ScalarType::f32, {0.01, 0, 10, 0, -0.01, 47}, 4326)
          .with_stop(stop.get_token());
  const TiledRaster raster(store, CoordinateSystem::of(store.schema().crs, "test").value(),
                           {store.schema(), HeightReference::ignore, "", 1 << 20}, 2);
  RasterTileSurface first(raster), second(raster);
  const GeographicBox box{12.8, 45.0, 14.0, 46.0}, other{10.5, 44.5, 11.0, 45.5};
  const Heights heights = sampled(first, box);
  EXPECT_GT(heights.size(), 1000u);
  // From now on, reading fails.
  stop.request_stop();
  EXPECT_EQ(sampled(second, box), heights);
  EXPECT_THROW(sampled(second, other), stream::Stopped);
}

TEST_F(RasterOfDegrees, ConcurrentCacheReadsMatchStore) {
  const stream::Store store =
      make<float>(stream::ScalarType::f32, {0.01, 0, 10, 0, -0.01, 47}, 4326);
  std::vector<double> expected(kColumns * kRows);
  StoreWindow(store).heights({0, 0, kColumns, kRows}, std::span<double>(expected));
  // Keep fewer squares than threads, then some of the six.
  for (const std::uint64_t bytes : {std::uint64_t{0}, std::uint64_t{1} << 20}) {
    HeightCache cache(store, bytes);
    std::atomic<std::size_t> wrong = 0;
    parallel_for(8, 8, [&](std::size_t) {
      StoreWindow reader(store);
      std::vector<double> heights(100);
      for (std::int64_t i = 0; i < 200; ++i) {
        const std::int64_t column = i * 331 % (kColumns - 10), row = i * 97 % (kRows - 10);
        cache.heights(reader, {column, row, 10, 10}, heights);
        for (std::int64_t k = 0; k < 100; ++k) {
          const auto at = static_cast<std::size_t>((row + k / 10) * kColumns + column + k % 10);
          const double height = heights[static_cast<std::size_t>(k)];
          if (!(height == expected[at] || std::isnan(expected[at]))) ++wrong;
        }
      }
    });
    EXPECT_EQ(wrong, 0u);
  }
}

TEST_F(RasterOfDegrees, CachedHeightsMatchStore) {
  const auto check = [&](const stream::Store& store) {
    // Keep no square, a few of the nine squares, or all.
    for (const std::uint64_t bytes :
         {std::uint64_t{0}, std::uint64_t{1} << 20, std::uint64_t{1} << 30}) {
      HeightCache cache(store, bytes);
      StoreWindow reader(store), plain(store);
      for (int round = 0; round < 60 / TERRACE_TEST_SHARE; ++round) {
        const LatticeWindow window{static_cast<std::int64_t>(random() * 800) - 50,
                                   static_cast<std::int64_t>(random() * 400) - 50,
                                   1 + static_cast<std::int64_t>(random() * 500),
                                   1 + static_cast<std::int64_t>(random() * random() * 300)};
        SCOPED_TRACE(testing::Message()
                     << bytes << " bytes, round " << round << ": " << window.column << ","
                     << window.row << " " << window.columns << " x " << window.rows);
        std::vector<double> cached(window.size()), read(window.size());
        cache.heights(reader, window, cached);
        plain.heights(window, std::span<double>(read));
        for (std::size_t i = 0; i < read.size(); ++i) {
          ASSERT_TRUE(cached[i] == read[i] || (std::isnan(cached[i]) && std::isnan(read[i]))) << i;
        }
      }
    }
  };
  check(make<float>(stream::ScalarType::f32, {0.01, 0, 10, 0, -0.01, 47}, 4326));
  check(make<double>(stream::ScalarType::f64, {0.01, 0, 10, 0, -0.01, 47}, 4326));
}

}  // namespace
}  // namespace terrace::terrain
