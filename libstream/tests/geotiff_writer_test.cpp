// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/geotiff_writer.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <numeric>
#include <optional>
#include <random>
#include <span>
#include <stop_token>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <tiffio.h>
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

TEST(GeoTiffWriter, ReadsBackWhatItWrote) {
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
    options.overviews = static_cast<GeoTiffOverviews>(random() % 3);
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
    options.threads = 1 + static_cast<unsigned>(round) % 3;
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
          const std::size_t first_column = std::size_t{across} * options.tile;
          const std::size_t width =
              std::min<std::size_t>(options.tile, options.columns - first_column);
          for (std::size_t r = 0; r < options.tile && down * options.tile + r < options.rows; ++r) {
            std::memcpy(
                tile.data() + r * options.tile * size,
                samples.data() + (down * options.tile + r) * row_bytes + first_column * size,
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
    // There must be no errors or warnings.
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

/// A level of a GeoTIFF as libtiff reads it; omitted tiles are filled with `missing`.
template <class T>
struct ReadLevel {
  std::uint32_t columns = 0, rows = 0;
  std::vector<T> samples;

  ReadLevel(const fs::path& path, unsigned level, T missing) {
    TIFFSetWarningHandler(nullptr);  // libtiff warns of tags that it does not know
    TIFF* const tiff = TIFFOpen(path.c_str(), "r");
    EXPECT_NE(tiff, nullptr);
    EXPECT_EQ(TIFFSetDirectory(tiff, static_cast<std::uint16_t>(level)), 1);
    std::uint32_t side = 0, kind = 0;
    TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &columns);
    TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &rows);
    TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &side);
    EXPECT_EQ(TIFFGetField(tiff, TIFFTAG_SUBFILETYPE, &kind), level > 0 ? 1 : 0);
    samples.assign(std::size_t{columns} * rows, missing);
    std::vector<T> tile(std::size_t{side} * side);
    for (std::uint32_t top = 0; top < rows; top += side) {
      for (std::uint32_t first_column = 0; first_column < columns; first_column += side) {
        const std::uint32_t number = TIFFComputeTile(tiff, first_column, top, 0, 0);
        if (TIFFGetStrileByteCount(tiff, number) == 0) continue;
        EXPECT_EQ(TIFFReadEncodedTile(tiff, number, tile.data(), -1),
                  static_cast<tmsize_t>(tile.size() * sizeof(T)));
        for (std::uint32_t r = 0; r < std::min(side, rows - top); ++r) {
          std::copy_n(tile.data() + r * side, std::min(side, columns - first_column),
                      samples.data() + std::size_t{top + r} * columns + first_column);
        }
      }
    }
    EXPECT_EQ(TIFFLastDirectory(tiff) != 0, columns <= 512 && rows <= 512);
    TIFFClose(tiff);
  }
};

/// Writes samples with overviews and without the tiles that have no data: in a random order, or in
/// quadtree order, in which some tiles are never passed to the writer.
template <class T>
void write_with_overviews(const fs::path& path, const GeoTiffOptions& options,
                          const std::vector<T>& samples, std::mt19937_64& random) {
  GeoTiffWriter writer(path, options);
  const std::uint32_t side = options.tile;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> places;
  for (std::uint32_t down = 0; down * side < options.rows; ++down) {
    for (std::uint32_t across = 0; across * side < options.columns; ++across) {
      places.emplace_back(across, down);
    }
  }
  std::shuffle(places.begin(), places.end(), random);
  for (const auto& [across, down] : places) {
    // Cells beyond the edge must not be visible.
    std::vector<T> tile(std::size_t{side} * side, T(99));
    bool any = false;
    for (std::uint32_t r = 0; r < std::min(side, options.rows - down * side); ++r) {
      for (std::uint32_t c = 0; c < std::min(side, options.columns - across * side); ++c) {
        const T value = samples[std::size_t{down * side + r} * options.columns + across * side + c];
        tile[std::size_t{r} * side + c] = value;
        any = any || !options.nodata || value != static_cast<T>(*options.nodata);
      }
    }
    if (any) {
      writer.write_tile(across, down, std::as_bytes(std::span(tile)));
    } else if (random() % 2 == 0) {
      writer.write_tile(across, down, {});
    }
  }
  writer.commit();
}

std::string geotiff_bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

template <class T>
void expect_overviews(std::mt19937_64& random, GeoTiffOverviews overviews,
                      std::optional<double> nodata) {
  const TempFolder folder;
  const fs::path path = folder.path() / "x.tif";
  GeoTiffOptions options;
  options.columns = 513 + static_cast<std::uint32_t>(random() % 1600);
  options.rows = 1 + static_cast<std::uint32_t>(random() % 900);
  if (random() % 2 == 0) std::swap(options.columns, options.rows);
  options.tile = 32 * (1 + static_cast<std::uint32_t>(random() % 4));
  options.sample.type = std::is_same_v<T, float>          ? ScalarType::f32
                        : std::is_same_v<T, std::uint8_t> ? ScalarType::u8
                                                          : ScalarType::i16;
  options.nodata = nodata;
  options.overviews = overviews;
  options.replace = true;
  std::vector<T> samples(std::size_t{options.columns} * options.rows);
  // Scattered squares of 100 cells with data, with holes.
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::size_t column = i % options.columns, row = i / options.columns;
    const bool has_data =
        !nodata || (((column / 100 * 7 + row / 100 * 5) % 3 == 0) && random() % 5 != 0);
    samples[i] = has_data ? static_cast<T>(1 + random() % 250) : static_cast<T>(*nodata);
  }
  write_with_overviews(path, options, samples, random);
  const std::string first = geotiff_bytes_of(path);
  options.threads = 2 + static_cast<unsigned>(random() % 3);
  write_with_overviews(path, options, samples, random);
  EXPECT_EQ(geotiff_bytes_of(path), first) << "depends on the order of the tiles, or on threads";

  std::uint32_t columns = options.columns, rows = options.rows;
  std::vector<T> below = samples;
  unsigned level = 0;
  for (;; ++level) {
    SCOPED_TRACE(level);
    const ReadLevel<T> read(path, level, static_cast<T>(nodata.value_or(0)));
    ASSERT_EQ(read.columns, columns);
    ASSERT_EQ(read.rows, rows);
    ASSERT_EQ(read.samples, below);
    if (columns <= 512 && rows <= 512) break;
    const std::uint32_t half_columns = (columns + 1) / 2, half_rows = (rows + 1) / 2;
    std::vector<T> half(std::size_t{half_columns} * half_rows);
    for (std::uint32_t r = 0; r < half_rows; ++r) {
      for (std::uint32_t c = 0; c < half_columns; ++c) {
        std::vector<T> some;
        for (std::uint32_t y = 2 * r; y < std::min(2 * r + 2, rows); ++y) {
          for (std::uint32_t x = 2 * c; x < std::min(2 * c + 2, columns); ++x) {
            const T value = below[std::size_t{y} * columns + x];
            if (!nodata || value != static_cast<T>(*nodata)) some.push_back(value);
          }
        }
        T& cell = half[std::size_t{r} * half_columns + c];
        if (some.empty()) {
          cell = static_cast<T>(nodata.value_or(0));
        } else if (overviews == GeoTiffOverviews::nearest) {
          cell = some.front();
        } else {
          const double mean = std::accumulate(some.begin(), some.end(), 0.0) / double(some.size());
          cell = static_cast<T>(std::is_integral_v<T> ? std::floor(mean + 0.5) : mean);
        }
      }
    }
    below = std::move(half);
    columns = half_columns;
    rows = half_rows;
  }
  EXPECT_GE(level, 1u);
}

TEST(GeoTiffWriter, OverviewsAverageTheCellsWithData) {
  constexpr std::uint64_t kSeed = 5;
  std::cout << "seed " << kSeed << '\n';
  std::mt19937_64 random(kSeed);
  for (int round = 0; round < 6; round += TERRACE_TEST_SHARE) {
    SCOPED_TRACE(round);
    expect_overviews<float>(random, GeoTiffOverviews::average, -9999);
    expect_overviews<std::int16_t>(random, GeoTiffOverviews::average, -32768);
    expect_overviews<std::uint8_t>(random, GeoTiffOverviews::average, 0);
    expect_overviews<float>(random, GeoTiffOverviews::nearest, -9999);
    expect_overviews<float>(random, GeoTiffOverviews::average, std::nullopt);
  }
}

/// A mean of opposite samples that equals the nodata value must not become nodata.
TEST(GeoTiffWriter, OverviewsKeepDataWhereTheMeanIsTheNodataValue) {
  const TempFolder folder;
  const fs::path path = folder.path() / "x.tif";
  GeoTiffOptions options;
  options.columns = 514;
  options.rows = 2;
  options.sample.type = ScalarType::i16;
  options.nodata = 0;
  options.overviews = GeoTiffOverviews::average;
  std::vector<std::int16_t> samples(1028);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i] = static_cast<std::int16_t>(i % 2 == 0 ? 7 : -7);
  }
  GeoTiffWriter writer(path, options);
  writer.write_rows(std::as_bytes(std::span(samples)));
  writer.commit();
  const ReadLevel<std::int16_t> read(path, 1, 0);
  EXPECT_EQ(read.columns, 257u);
  EXPECT_EQ(std::count(read.samples.begin(), read.samples.end(), 0), 0);
}

/// GDAL recognises it as a COG and reads from its overviews.
TEST(GeoTiffWriter, GdalFindsTheOverviews) {
  if (!has_gdal()) GTEST_SKIP() << "needs gdalinfo";
  const TempFolder folder;
  const std::string path = (folder.path() / "x.tif").string();
  GeoTiffOptions options;
  options.columns = 2100;
  options.rows = 1300;
  options.sample.type = ScalarType::f32;
  options.nodata = -9999;
  options.overviews = GeoTiffOverviews::average;
  std::vector<float> samples(std::size_t{2100} * 1300);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i] = i % 977 == 0 ? -9999.0f : static_cast<float>(i % 2100 + 2 * (i / 2100));
  }
  GeoTiffWriter writer(path, options);
  writer.write_rows(std::as_bytes(std::span(samples)));
  writer.commit();
  const nlohmann::json info = gdalinfo(path);
  ASSERT_FALSE(info.is_discarded());
  EXPECT_EQ(info["metadata"]["IMAGE_STRUCTURE"]["LAYOUT"], "COG");
  const auto& overviews = info["bands"][0]["overviews"];
  ASSERT_EQ(overviews.size(), 3u);
  EXPECT_EQ(overviews[0]["size"], (nlohmann::json{1050, 650}));
  EXPECT_EQ(overviews[2]["size"], (nlohmann::json{263, 163}));
  EXPECT_EQ(output_of("gdalinfo '" + path + "' 2>&1 >/dev/null | head -3"), "");
  const std::string half = (folder.path() / "half.tif").string();
  output_of("gdal_translate -ovr 0 '" + path + "' '" + half + "'");
  const WholeRaster read = read_whole(*open_geotiff(half));
  const ReadLevel<float> level(path, 1, -9999);
  ASSERT_EQ(read.cells(), level.samples.size());
  for (std::size_t i = 0; i < read.cells(); ++i) {
    ASSERT_EQ(read.valid[i] != 0, level.samples[i] != -9999.0f) << i;
    ASSERT_TRUE(read.valid[i] == 0 || read.as<float>(i) == level.samples[i]) << i;
  }
}

TEST(GeoTiffWriter, LeavesNothingWithoutCommitAndKeepsExistingFiles) {
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

TEST(GeoTiffWriter, StopsWhileTilesAreCopied) {
  const TempFolder folder;
  std::stop_source stop;
  GeoTiffOptions options;
  options.columns = options.rows = 600;
  options.overviews = GeoTiffOverviews::average;
  options.stop = stop.get_token();
  {
    GeoTiffWriter writer(folder.path() / "x.tif", options);
    writer.write_rows(std::vector<std::byte>(600 * 600 * 8));
    stop.request_stop();
    EXPECT_THROW(writer.commit(), Stopped);
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

class FileSizeLimit : public ::testing::TestWithParam<GeoTiffOverviews> {};

TEST_P(FileSizeLimit, IsAnErrorAndLeavesNothing) {
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
      options.overviews = GetParam();
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

INSTANTIATE_TEST_SUITE_P(GeoTiffWriter, FileSizeLimit,
                         ::testing::Values(GeoTiffOverviews::none, GeoTiffOverviews::average));

/// The file is sparse, so that it stays small: the test is that offsets have 64 bits.
TEST(GeoTiffWriter, WritesBigTiffWhereFourGigabytesMightNotSuffice) {
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
