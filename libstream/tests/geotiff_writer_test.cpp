// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/geotiff_writer.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "gdal_tools.hpp"
#include "raster_testing.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;

std::vector<std::byte> random_bytes(std::mt19937_64& random, std::size_t size) {
  std::vector<std::byte> bytes(size);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random() % 64);  // no NaN, no infinity
  return bytes;
}

TEST(GeoTiffWriter, WhatIsWrittenIsReadBack) {
  std::mt19937_64 random(11);
  const TempFolder folder;
  for (int round = 0; round < 60; ++round) {
    GeoTiffOptions options;
    options.columns = 1 + static_cast<std::uint32_t>(random() % 100);
    options.rows = 1 + static_cast<std::uint32_t>(random() % 100);
    options.tile = 16 * (1 + static_cast<std::uint32_t>(random() % 4));
    options.sample.type = static_cast<ScalarType>(round % 10);
    options.compression = static_cast<GeoTiffCompression>(random() % 3);
    options.predictor = random() % 2 == 0;
    options.pixel_is_point = random() % 2 == 0;
    options.world = {{30, 0, 500015, 0, -30, 4000015}};
    if (random() % 4 == 0) options.world = {{30, 1, 500015, -1, 30, 4000015}};
    options.crs.epsg = 32632;
    options.crs.horizontal_unit = "metre";
    options.crs.vertical_epsg = 5773;
    options.crs.vertical_unit = "metre";
    options.sample.scale = 0.1;
    options.sample.offset = -100;
    options.sample.unit = "metre";
    options.nodata = 200;  // never written
    options.replace = true;
    SCOPED_TRACE("round " + std::to_string(round));
    const std::string path = (folder.path() / "x.tif").string();
    const std::size_t size = size_of(options.sample.type);
    const std::size_t row_bytes = options.columns * size;
    const auto samples = random_bytes(random, row_bytes * options.rows);
    GeoTiffWriter writer(path, options);
    if (random() % 2 == 0) {
      for (std::size_t row = 0; row < options.rows;) {
        const std::size_t rows = std::min<std::size_t>(random() % 40, options.rows - row);
        writer.write_rows(std::span(samples).subspan(row * row_bytes, rows * row_bytes));
        row += rows;
      }
    } else {
      for (std::uint32_t down = 0; down * options.tile < options.rows; ++down) {
        for (std::uint32_t across = 0; across * options.tile < options.columns; ++across) {
          std::vector<std::byte> tile(std::size_t{options.tile} * options.tile * size);
          const std::size_t left = std::size_t{across} * options.tile;
          const std::size_t width = std::min<std::size_t>(options.tile, options.columns - left);
          for (std::size_t r = 0; r < options.tile && down * options.tile + r < options.rows; ++r) {
            std::memcpy(tile.data() + r * options.tile * size,
                        samples.data() + (down * options.tile + r) * row_bytes + left * size,
                        width * size);
          }
          writer.write_tile(across, down, tile);
        }
      }
    }
    writer.commit();
    const WholeRaster whole = read_whole(*open_geotiff(path));
    ASSERT_EQ(whole.info.columns, options.columns);
    ASSERT_EQ(whole.info.rows, options.rows);
    ASSERT_EQ(whole.samples, samples);
    ASSERT_EQ(whole.info.world, options.world);
    Crs crs = whole.info.crs;
    crs.geo_keys.clear();
    ASSERT_EQ(crs, options.crs);
    ASSERT_EQ(whole.info.nodata, options.nodata);
    options.sample.name = "height";
    ASSERT_EQ(whole.info.sample, options.sample);
  }
}

TEST(GeoTiffWriter, GdalReadsTheSame) {
  if (!has_gdal()) GTEST_SKIP() << "needs gdalinfo";
  const TempFolder folder;
  for (const bool geographic : {false, true}) {
    SCOPED_TRACE(geographic);
    const std::string path = (folder.path() / "x.tif").string();
    GeoTiffOptions options;
    options.columns = 300;
    options.rows = 200;
    options.sample.type = ScalarType::f32;
    options.sample.scale = 0.5;
    options.compression = geographic ? GeoTiffCompression::zstd : GeoTiffCompression::deflate;
    options.world = geographic ? WorldTransform{{0.25, 0, 7.125, 0, -0.25, 49.875}}
                               : WorldTransform{{10, 0, 600005, 0, -10, 5000005}};
    options.crs.geographic = geographic;
    options.crs.epsg = geographic ? 4326 : 25832;
    options.nodata = -9999;
    options.replace = true;
    std::vector<float> values(std::size_t{300} * 200);
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = i == 77 ? -9999.0f : static_cast<float>(i % 1000) * 0.25f;
    }
    GeoTiffWriter writer(path, options);
    writer.write_rows(std::as_bytes(std::span(values)));
    writer.commit();
    const nlohmann::json info = gdalinfo(path, "-stats");
    ASSERT_FALSE(info.is_discarded());
    EXPECT_EQ(info["size"], (nlohmann::json{300, 200}));
    const auto expected = geographic ? std::vector<double>{7.0, 0.25, 0, 50.0, 0, -0.25}
                                     : std::vector<double>{600000, 10, 0, 5000010, 0, -10};
    EXPECT_EQ(info["geoTransform"].get<std::vector<double>>(), expected);
    EXPECT_EQ(info["stac"]["proj:epsg"], options.crs.epsg);
    const auto& band = info["bands"][0];
    EXPECT_EQ(band["type"], "Float32");
    EXPECT_EQ(band["noDataValue"], -9999.0);
    EXPECT_EQ(band["scale"], 0.5);
    EXPECT_EQ(band["block"], (nlohmann::json{256, 256}));
    EXPECT_EQ(band["minimum"], 0.0);
    EXPECT_EQ(band["maximum"], 249.75);
    EXPECT_EQ(info["metadata"]["IMAGE_STRUCTURE"]["COMPRESSION"], geographic ? "ZSTD" : "DEFLATE");
    // There must be no complaint of any kind.
    EXPECT_EQ(output_of("gdalinfo '" + path + "' 2>&1 >/dev/null | head -3"), "");
  }
}

TEST(GeoTiffWriter, TilesNotWrittenHaveNoData) {
  const TempFolder folder;
  const std::string path = (folder.path() / "x.tif").string();
  GeoTiffOptions options;
  options.columns = options.rows = 64;
  options.tile = 32;
  options.sample.type = ScalarType::u8;
  options.nodata = 255;
  GeoTiffWriter writer(path, options);
  writer.write_tile(1, 0, std::vector<std::byte>(1024, std::byte{7}));
  writer.commit();
  const WholeRaster whole = read_whole(*open_geotiff(path));
  EXPECT_EQ(std::count(whole.valid.begin(), whole.valid.end(), 1), 1024);
  EXPECT_EQ(whole.valid[32], 1);
  EXPECT_EQ(whole.valid[31], 0);
}

TEST(GeoTiffWriter, LeavesNothingWithoutCommitAndKeepsWhatIsThere) {
  const TempFolder folder;
  const fs::path path = folder.path() / "x.tif";
  GeoTiffOptions options;
  options.columns = options.rows = 10;
  {
    GeoTiffWriter writer(path, options);
    writer.write_rows(std::vector<std::byte>(400));
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
  GeoTiffWriter first(path, options);
  first.commit();
  EXPECT_THROW(GeoTiffWriter(path, options), Error);
}

TEST(GeoTiffWriter, AFileSizeLimitIsAnErrorAndLeavesNothing) {
  const TempFolder folder;
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const rlimit limit{100000, 100000};
    setrlimit(RLIMIT_FSIZE, &limit);
    int code = 1;
    try {
      GeoTiffOptions options;
      options.columns = options.rows = 2000;
      options.compression = GeoTiffCompression::none;
      GeoTiffWriter writer(folder.path() / "x.tif", options);
      writer.write_rows(std::vector<std::byte>(2000 * 2000 * 8));
      writer.commit();
    } catch (const Error& error) {
      code = std::string(error.what()).find("File too large") != std::string::npos ? 0 : 2;
    }
    _exit(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

/// Sparse, so that the file stays small: what counts is that offsets are 64 bits wide.
TEST(GeoTiffWriter, IsABigTiffWhereFourGigabytesMightNotDo) {
  const TempFolder folder;
  const auto magic_of = [&](std::uint32_t rows) {
    const fs::path path = folder.path() / (std::to_string(rows) + ".tif");
    GeoTiffOptions options;
    options.columns = 65536;
    options.rows = rows;
    options.sample.type = ScalarType::u8;
    options.tile = 1024;
    GeoTiffWriter writer(path, options);
    writer.write_tile(0, 0, std::vector<std::byte>(1024 * 1024));
    writer.commit();
    EXPECT_EQ(open_geotiff(path.string())->info().rows, rows);
    std::FILE* const file = std::fopen(path.c_str(), "rb");
    char head[4] = {};
    EXPECT_EQ(std::fread(head, 1, 4, file), 4u);
    std::fclose(file);
    return static_cast<int>(head[2]) + static_cast<int>(head[3]);
  };
  EXPECT_EQ(magic_of(1024), 42);
  EXPECT_EQ(magic_of(70000), 43);
}

}  // namespace
}  // namespace terrace::stream
