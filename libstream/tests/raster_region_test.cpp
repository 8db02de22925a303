// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tiffio.h>

#include "gdal_tools.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"
#include "terrace/stream/source.hpp"
#include "tiff_writing.hpp"

/// Tests Selection::region of rasters: only blocks with cells inside are read.

namespace terrace::stream {
namespace {

constexpr std::uint64_t kBlockSide = 16;

/// Records which blocks of a raster were read.
struct Reading {
  std::uint64_t cells = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> blocks;  ///< of each window, with repeats
};

/// A raster whose samples are a function of their place; one in eleven is void.
class SyntheticRaster final : public Raster {
 public:
  SyntheticRaster(std::uint64_t columns, std::uint64_t rows, const WorldTransform& world,
                  Reading& reading)
      : reading_(reading) {
    info_.files = {"synthetic"};
    info_.columns = columns;
    info_.rows = rows;
    info_.sample.type = ScalarType::i32;
    info_.world = world;
    info_.block_columns = info_.block_rows = kBlockSide;
  }
  [[nodiscard]] const RasterInfo& info() const override { return info_; }
  bool read_over(const CellWindow& window, const CellBuffer& out) override {
    reading_.cells += window.columns * window.rows;
    EXPECT_LE(window.column + window.columns, info_.columns);
    EXPECT_LE(window.row + window.rows, info_.rows);
    for (std::uint64_t r = window.row / kBlockSide; r * kBlockSide < window.row + window.rows;
         ++r) {
      for (std::uint64_t c = window.column / kBlockSide;
           c * kBlockSide < window.column + window.columns; ++c) {
        reading_.blocks.emplace_back(c, r);
      }
    }
    bool any = false;
    for (std::uint64_t r = 0; r < window.rows; ++r) {
      for (std::uint64_t c = 0; c < window.columns; ++c) {
        const std::uint64_t column = window.column + c, row = window.row + r;
        if ((7 * column + 3 * row) % 11 == 0) continue;
        const auto sample = static_cast<std::int32_t>(column * 1000 + row);
        std::memcpy(out.samples + (r * out.stride + c) * sizeof sample, &sample, sizeof sample);
        out.valid[r * out.stride + c] = 1;
        any = true;
      }
    }
    return any;
  }

 private:
  Reading& reading_;
  RasterInfo info_;
};

std::vector<Point3> points_in_order(PointSource& source) {
  std::vector<Point3> points;
  for (PointBlock block; source.next(block);) {
    points.insert(points.end(), block.positions.begin(), block.positions.end());
  }
  return points;
}

/// Returns the points in the CRS, sorted.
std::vector<Point3> world_points(PointSource& source) {
  std::vector<Point3> points = points_in_order(source);
  for (Point3& p : points) p = world_point(source.info(), p);
  std::sort(points.begin(), points.end());
  return points;
}

std::vector<Point3> inside(std::vector<Point3> points, const Box3& region) {
  std::erase_if(points, [&](const Point3& p) { return !region.contains(p); });
  return points;
}

Box3 flat_box(double left, double bottom, double right, double top) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return {{left, bottom, -kInfinity}, {right, top, kInfinity}};
}

TEST(RasterRegion, ReadsTheBlocksInsideOnceAndNoOthers) {
  constexpr std::uint64_t kSeed = 41;
  std::cout << "seed " << kSeed << '\n';
  std::mt19937_64 random(kSeed);
  // Cell sizes are powers of two, so that places are exact; the last raster is rotated.
  const std::array<WorldTransform, 3> worlds{
      {{}, {.xy = {0.5, 0, -20, 0, -0.25, 70}}, {.xy = {0.5, -0.25, 5, 0.25, 0.5, -3}}}};
  std::size_t in_all = 0, without = 0;
  for (int round = 0; round < 150; ++round) {
    SCOPED_TRACE(round);
    const std::uint64_t columns = 1 + random() % 300, rows = 1 + random() % 300;
    const WorldTransform& world = worlds[static_cast<std::size_t>(round) % 3];
    SourceOptions options{.block_points = 1 + random() % 900};
    options.memory_bytes = round % 2 == 0 ? 64u << 20 : 100'000;  // many windows
    Reading reading;
    const auto full_source =
        points_of(std::make_unique<SyntheticRaster>(columns, rows, world, reading), options);
    const Box3 extent =
        world_box(full_source->info(), {{0, 0, 0}, {double(columns), double(rows), 0}});
    std::array<std::array<double, 2>, 2> sides{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const auto place = [&] {
        const double span = extent.max[axis] - extent.min[axis];
        return extent.min[axis] + span * std::uniform_real_distribution(-0.3, 1.3)(random);
      };
      sides[axis] = {place(), place()};
      if (sides[axis][0] > sides[axis][1]) std::swap(sides[axis][0], sides[axis][1]);
    }
    const Box3 region = flat_box(sides[0][0], sides[1][0], sides[0][1], sides[1][1]);
    const std::vector<Point3> expected = inside(world_points(*full_source), region);
    in_all += expected.size();
    without += expected.empty() ? 1 : 0;

    reading = {};
    options.selection.region = region;
    const auto part =
        points_of(std::make_unique<SyntheticRaster>(columns, rows, world, reading), options);
    const std::vector<Point3> part_points = world_points(*part);
    EXPECT_EQ(inside(part_points, region), expected);
    EXPECT_EQ(std::adjacent_find(part_points.begin(), part_points.end()), part_points.end());
    const Progress progress = part->progress();
    EXPECT_EQ(progress.points, part_points.size());
    EXPECT_EQ(progress.points + progress.nodata + progress.excluded, columns * rows);
    EXPECT_EQ(progress.points + progress.nodata, reading.cells);
    EXPECT_EQ(*part->info().points, reading.cells);
    std::sort(reading.blocks.begin(), reading.blocks.end());
    EXPECT_EQ(std::adjacent_find(reading.blocks.begin(), reading.blocks.end()),
              reading.blocks.end());
    if (round % 3 == 2) continue;  // a box around a part of a rotated raster contains more
    const double across = std::abs(world.xy[0]), down = std::abs(world.xy[4]);
    const Box3 around = flat_box(region.min[0] - 2 * across, region.min[1] - 2 * down,
                                 region.max[0] + 2 * across, region.max[1] + 2 * down);
    EXPECT_EQ(inside(part_points, around), part_points);
  }
  EXPECT_GT(in_all, 500'000u);
  EXPECT_GT(without, 2u);
}

/// Overwrites the tiles of a GeoTIFF except those for which `keeps` is true, so that reading them
/// fails. Returns the number of tiles left.
std::size_t damage_tiles(const std::filesystem::path& file,
                         const std::function<bool(std::uint32_t, std::uint32_t)>& keeps) {
  struct Place {
    std::uint64_t offset, bytes;
  };
  std::vector<Place> damaged;
  std::size_t kept_tiles = 0;
  TIFFSetWarningHandler(nullptr);  // libtiff warns of tags that it does not know
  TIFF* const tiff = TIFFOpen(file.c_str(), "r");
  EXPECT_NE(tiff, nullptr);
  std::uint32_t columns = 0, side = 0;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &columns);
  TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &side);
  const std::uint32_t across = (columns + side - 1) / side;
  for (std::uint32_t tile = 0; tile < TIFFNumberOfTiles(tiff); ++tile) {
    if (keeps(tile % across, tile / across)) {
      ++kept_tiles;
    } else {
      damaged.push_back({TIFFGetStrileOffset(tiff, tile), TIFFGetStrileByteCount(tiff, tile)});
    }
  }
  TIFFClose(tiff);
  std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
  for (const Place& place : damaged) {
    bytes.seekp(static_cast<std::streamoff>(place.offset));
    bytes << std::string(place.bytes, '\xff');
  }
  EXPECT_TRUE(bytes.good());
  return kept_tiles;
}

class RegionOfFiles : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kSide = 640, kTile = 64;

  /// Tiles of 64 x 64 cells of 1, the upper left corner at (x, kSide).
  std::string write(const std::string& name, double x) const {
    std::vector<std::int16_t> samples(std::size_t{kSide} * kSide);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      samples[i] = static_cast<std::int16_t>(i % kSide * 31 + i / kSide * 7);
    }
    TiffSpec spec;
    spec.columns = spec.rows = kSide;
    spec.compression = COMPRESSION_ADOBE_DEFLATE;
    spec.tile_columns = spec.tile_rows = kTile;
    spec.more = placed_at(x, kSide);
    write_tiff(folder_.path() / name, spec, as_samples(samples));
    return (folder_.path() / name).string();
  }
  static std::vector<Point3> read(const std::vector<std::string>& files,
                                  const std::optional<Box3>& region = std::nullopt) {
    SourceOptions options;
    options.selection.region = region;
    return world_points(*open_source(files, options));
  }

  TempFolder folder_;
};

TEST_F(RegionOfFiles, ReadsOnlyTheNecessaryTilesOfAGeoTiff) {
  const std::string file = write("a.tif", 0);
  const Box3 region = flat_box(130, 400, 250, 500);  // columns 130 to 249, rows 140 to 239
  const std::vector<Point3> expected = inside(read({file}), region);
  EXPECT_EQ(expected.size(), 120u * 100);
  const std::size_t kept_tiles = damage_tiles(file, [](std::uint32_t across, std::uint32_t down) {
    return across >= 2 && across <= 3 && down >= 2 && down <= 3;
  });
  EXPECT_EQ(kept_tiles, 4u);
  EXPECT_THROW(read({file}), Error);
  EXPECT_EQ(read({file}, region), expected);
}

TEST_F(RegionOfFiles, ReadsOnlyTheNecessaryTilesOfAMosaic) {
  const std::vector<std::string> files{write("a.tif", 0), write("b.tif", kSide),
                                       write("c.tif", 2 * kSide)};
  const Box3 region = flat_box(kSide - 10, 600, kSide + 10, 620);
  const std::vector<Point3> expected = inside(read(files), region);
  EXPECT_EQ(expected.size(), 400u);
  damage_tiles(files[0],
               [](std::uint32_t across, std::uint32_t down) { return across == 9 && down == 0; });
  damage_tiles(files[1],
               [](std::uint32_t across, std::uint32_t down) { return across == 0 && down == 0; });
  damage_tiles(files[2], [](std::uint32_t, std::uint32_t) { return false; });
  EXPECT_THROW(read(files), Error);
  EXPECT_EQ(read(files, region), expected);
}

TEST_F(RegionOfFiles, ReadsOnlyTheNecessaryTilesOfAVrtAndACog) {
  if (!has_gdal()) GTEST_SKIP() << "gdal-bin is not installed";
  const std::string a = write("a.tif", 0), b = write("b.tif", kSide);
  const std::string vrt = (folder_.path() / "ab.vrt").string();
  output_of("gdalbuildvrt '" + vrt + "' '" + a + "' '" + b + "'");
  const Box3 region = flat_box(kSide - 10, 600, kSide + 10, 620);
  const std::vector<Point3> expected = inside(read({vrt}), region);
  EXPECT_EQ(expected.size(), 400u);

  const std::string cog = (folder_.path() / "cog.tif").string();
  output_of("gdal_translate -of COG -co BLOCKSIZE=128 -co COMPRESS=DEFLATE '" + vrt + "' '" + cog +
            "'");
  EXPECT_EQ(read({cog}), read({vrt}));
  EXPECT_EQ(damage_tiles(cog,
                         [](std::uint32_t across, std::uint32_t down) {
                           return (across == 4 || across == 5) && down == 0;
                         }),
            2u);
  EXPECT_THROW(read({cog}), Error);
  EXPECT_EQ(read({cog}, region), expected);

  damage_tiles(a,
               [](std::uint32_t across, std::uint32_t down) { return across == 9 && down == 0; });
  damage_tiles(b,
               [](std::uint32_t across, std::uint32_t down) { return across == 0 && down == 0; });
  EXPECT_THROW(read({vrt}), Error);
  EXPECT_EQ(read({vrt}, region), expected);
}

TEST(RasterRegion, AsciiGridGivesThePointsInside) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.asc").string();
  {
    std::ofstream text(file);
    text << "ncols 97\nnrows 83\nxllcorner 1000\nyllcorner 2000\ncellsize 10\nNODATA_value -9\n";
    for (int row = 0; row < 83; ++row) {
      for (int column = 0; column < 97; ++column) {
        text << (column * row % 13 == 5 ? -9 : column + row / 4.0) << ' ';
      }
      text << '\n';
    }
  }
  SourceOptions options{.block_points = 200};
  const std::vector<Point3> all = world_points(*open_source(std::span(&file, 1), options));
  options.selection.region = Box3{{1203, 2110, -1e9}, {1555, 2404, 60}};
  const auto part = open_source(std::span(&file, 1), options);
  const std::vector<Point3> part_points = world_points(*part);
  EXPECT_EQ(part_points, inside(all, *options.selection.region));
  EXPECT_GT(part_points.size(), 500u);
  const Progress progress = part->progress();
  EXPECT_EQ(progress.points, part_points.size());
  EXPECT_EQ(progress.points + progress.nodata + progress.excluded, 97u * 83);
}

/// A raster without data that calls a function for every window.
class VoidRaster final : public Raster {
 public:
  VoidRaster(std::uint64_t columns, std::uint64_t rows, std::function<void()> on_window)
      : on_window_(std::move(on_window)) {
    info_.files = {"void.vrt"};
    info_.columns = columns;
    info_.rows = rows;
    info_.sample.type = ScalarType::i16;
  }
  [[nodiscard]] const RasterInfo& info() const override { return info_; }
  bool read_over(const CellWindow&, const CellBuffer&) override {
    on_window_();
    return false;
  }

 private:
  std::function<void()> on_window_;
  RasterInfo info_;
};

TEST(RasterPoints, AStopRequestEndsTheSearchForCellsWithData) {
  std::stop_source stop;
  int windows = 0;
  const auto source = points_of(std::make_unique<VoidRaster>(1u << 24, 1u << 24,
                                                             [&] {
                                                               if (++windows == 3)
                                                                 stop.request_stop();
                                                             }),
                                {.stop = stop.get_token()});
  PointBlock block;
  EXPECT_THROW(source->next(block), Stopped);
  EXPECT_EQ(windows, 3);
}

TEST(RasterPoints, RefusesMoreCellsThanAStoreCanHold) {
  const auto open = [](std::uint64_t columns, const std::optional<Box3>& region) {
    SourceOptions options;
    options.selection.region = region;
    return points_of(std::make_unique<VoidRaster>(columns, (1u << 30) - 1, [] {}), options);
  };
  EXPECT_NO_THROW(open(1u << 18, std::nullopt));
  try {
    open((1u << 18) + 1, std::nullopt);
    ADD_FAILURE() << "accepted more than 2^48 cells";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("262145 x 1073741823 cells"), std::string::npos)
        << error.what();
  }
  // A part may be small enough.
  EXPECT_NO_THROW(open((1u << 30) - 1, Box3{{0, 0, -1e9}, {1000, 1000, 1e9}}));
}

}  // namespace
}  // namespace terrace::stream
