// SPDX-License-Identifier: Apache-2.0 Elevation grids other than GeoTIFF, compared with GDAL's
// tools.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <png.h>

#include "format/grid/binary.hpp"
#include "format/grid/rasters.hpp"
#include "gdal_tools.hpp"
#include "raster_testing.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;

class Grids : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string put(const std::string& name, const std::string& content) const {
    std::ofstream(path(name), std::ios::binary) << content;
    return path(name);
  }
  /// Runs a command in the folder.
  void run(const std::string& command) const {
    const std::string line =
        "cd '" + folder_.path().string() + "' && " + command + " >/dev/null 2>&1";
    ASSERT_EQ(std::system(line.c_str()), 0) << command;
  }
  /// Makes a GeoTIFF to convert: 16-bit heights with voids, in degrees or metres.
  void make_tiff(const std::string& name, int columns, int rows, const std::string& options) const {
    std::string text = "ncols " + std::to_string(columns) + "\nnrows " + std::to_string(rows) +
                       "\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value -32768\n";
    std::uint32_t state = 1;
    for (int i = 0; i < columns * rows; ++i) {
      state = state * 1664525u + 1013904223u;
      text += state >> 28 == 0 ? "-32768" : std::to_string(static_cast<int>(state >> 20) - 100);
      text += (i + 1) % columns == 0 ? '\n' : ' ';
    }
    put("made.asc", text);
    run("gdal_translate -q -of GTiff -ot Int16 " + options + " made.asc " + name);
  }

  TempFolder folder_;
};

std::unique_ptr<PointSource> open_one(const std::string& file, const SourceOptions& options = {}) {
  return open_source(std::span(&file, 1), options);
}

std::string refusal_of(const std::string& file, const SourceOptions& options = {}) {
  try {
    const auto source = open_one(file, options);
    PointBlock block;
    while (source->next(block)) {
    }
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return {};
}

/// Expects the same cells in the same places, with the same nodata cells.
void expect_same(Raster& found, Raster& expected) {
  const WholeRaster a = read_whole(found), b = read_whole(expected);
  ASSERT_EQ(a.info.columns, b.info.columns);
  ASSERT_EQ(a.info.rows, b.info.rows);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(a.info.world.xy[i], b.info.world.xy[i], 1e-9 * (1 + std::abs(b.info.world.xy[i])));
  }
  const Channel &za = a.info.sample, &zb = b.info.sample;
  for (std::size_t i = 0; i < a.cells(); ++i) {
    ASSERT_EQ(a.valid[i], b.valid[i]) << i;
    if (a.valid[i] == 0) continue;
    const double x = a.value(i) * za.scale + za.offset, y = b.value(i) * zb.scale + zb.offset;
    // GDAL converts decimals to floats.
    const bool rounded = zb.type == ScalarType::f32;
    ASSERT_EQ(rounded ? static_cast<float>(x) : x, y) << i;
  }
  // Also by windows.
  std::vector<std::byte> samples(7 * 3 * size_of(za.type));
  std::vector<std::uint8_t> valid(7 * 3);
  const std::uint64_t row = a.info.rows / 2, column = a.info.columns / 3;
  const std::uint64_t rows = std::min<std::uint64_t>(3, a.info.rows - row);
  const std::uint64_t columns = std::min<std::uint64_t>(6, a.info.columns - column);
  found.read_over({column, row, columns, rows}, {samples.data(), valid.data(), 7});
  for (std::uint64_t r = 0; r < rows; ++r) {
    for (std::uint64_t c = 0; c < columns; ++c) {
      const std::size_t cell = (row + r) * a.info.columns + column + c;
      ASSERT_EQ(valid[r * 7 + c], a.valid[cell]);
      if (a.valid[cell] != 0) {
        ASSERT_EQ(std::memcmp(&samples[(r * 7 + c) * size_of(za.type)],
                              &a.samples[cell * size_of(za.type)], size_of(za.type)),
                  0);
      }
    }
  }
}

TEST_F(Grids, BinaryGridsMatchWhatGdalConverted) {
  if (!has_gdal()) GTEST_SKIP() << "no gdal-bin";
  make_tiff("a.tif", 61, 37, "-a_ullr 500000 5200370 500610 5200000");
  for (const std::string type : {"Byte", "Int16", "UInt16", "Int32", "UInt32", "Float32"}) {
    run("gdal_translate -q -ot " + type + " a.tif b.tif");
    run("gdal_translate -q -of EHdr b.tif b.bil");
    expect_same(*open_binary_grid(path("b.bil")), *open_geotiff(path("b.tif")));
    EXPECT_EQ(open_one(path("b.bil"))->info().format, "binary-grid");
  }
  // GDAL's own reading of the other layouts.
  run("gdal_translate -q -b 1 -b 1 -b 1 -scale_2 -100 4000 0 99 -scale_3 -100 4000 5 7 a.tif "
      "c.tif");
  for (const std::string layout : {"BIL", "BIP", "BSQ"}) {
    const WholeRaster three[] = {read_whole(*open_geotiff(path("c.tif"), {.band = 1})),
                                 read_whole(*open_geotiff(path("c.tif"), {.band = 2})),
                                 read_whole(*open_geotiff(path("c.tif"), {.band = 3}))};
    const std::size_t columns = 61, rows = 37;
    std::string bytes(11, 'x');
    const auto add = [&](std::size_t band, std::size_t cell) {
      const auto value = static_cast<std::uint16_t>(
          three[band].valid[cell] != 0 ? three[band].as<std::int16_t>(cell) : -32768);
      bytes += static_cast<char>(value >> 8);
      bytes += static_cast<char>(value & 0xFF);
    };
    if (layout == "BSQ") {
      for (std::size_t b = 0; b < 3; ++b)
        for (std::size_t i = 0; i < columns * rows; ++i) add(b, i);
    } else if (layout == "BIP") {
      for (std::size_t i = 0; i < columns * rows; ++i)
        for (std::size_t b = 0; b < 3; ++b) add(b, i);
    } else {
      for (std::size_t r = 0; r < rows; ++r)
        for (std::size_t b = 0; b < 3; ++b)
          for (std::size_t c = 0; c < columns; ++c) add(b, r * columns + c);
    }
    put("d.bsq", bytes);
    put("d.hdr", "BYTEORDER M\r\nLAYOUT " + layout +
                     "\r\nNROWS 37\r\nNCOLS 61\r\nNBANDS 3\r\nNBITS 16\r\n"
                     "PIXELTYPE SIGNEDINT\r\nSKIPBYTES 11\r\nULXMAP 500005\r\nULYMAP "
                     "5200365\r\nXDIM 10\r\nYDIM 10\r\nNODATA -32768\r\n");
    for (int band = 1; band <= 3; ++band) {
      expect_same(*open_binary_grid(path("d.bsq"), {.band = band}),
                  *open_geotiff(path("c.tif"), {.band = band}));
    }
    EXPECT_THROW(open_binary_grid(path("d.bsq"), {.band = 4}), Error);
  }
}

TEST_F(Grids, ReadsHeadersOfFloatGrids) {
  std::string bytes;
  for (int i = 0; i < 12; ++i) {
    const float value = i == 5 ? -9999.0F : 1.5F * static_cast<float>(i);
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  put("a.flt", bytes);
  put("a.hdr",
      "ncols 4\nnrows 3\nxllcorner 100\nyllcenter 205\ncellsize 10\nNODATA_value -9999\nbyteorder "
      "LSBFIRST\n");
  const WholeRaster whole = read_whole(*open_binary_grid(path("a.flt")));
  EXPECT_EQ(whole.info.world.xy, (std::array<double, 6>{10, 0, 105, 0, -10, 225}));
  EXPECT_EQ(whole.info.sample.type, ScalarType::f32);
  EXPECT_EQ(whole.info.nodata, -9999);
  EXPECT_EQ(whole.valid[5], 0);
  EXPECT_EQ(whole.value(11), 16.5);
  if (has_gdal()) {
    const auto info = gdalinfo(path("a.flt"));
    EXPECT_EQ(info["driverShortName"], "EHdr");
  }
}

TEST_F(Grids, ReadsGtopo30TilesAsBinaryGrids) {
  put("E020N40.DEM", std::string("\x00\x05\xd8\xf1\xff\xff\x01\x00\x00\x01\x00\x02", 12));
  put("E020N40.HDR",
      "BYTEORDER      M\nLAYOUT       BIL\nNROWS         2\nNCOLS         3\nNBANDS        1\n"
      "NBITS         16\nBANDROWBYTES         6\nTOTALROWBYTES        6\nBANDGAPBYTES         0\n"
      "NODATA        -9999\nULXMAP        20.25\nULYMAP        39.75\nXDIM          0.5\n"
      "YDIM          0.5\n");
  const std::vector<std::string> files{path("E020N40.DEM")};
  const auto source = open_source(files);
  EXPECT_EQ(source->info().format, "binary-grid");
  EXPECT_EQ(source->info().world.xy, (std::array<double, 6>{0.5, 0, 20.25, 0, -0.5, 39.75}));
  std::vector<double> heights;
  for (PointBlock block; source->next(block);) {
    for (const Point3& p : block.positions) heights.push_back(p[2]);
  }
  std::sort(heights.begin(), heights.end());
  EXPECT_EQ(heights, (std::vector<double>{-1, 1, 2, 5, 256}));
  // Without a header file, a .dem can only be a USGS DEM.
  std::filesystem::remove(path("E020N40.HDR"));
  EXPECT_THROW(open_source(files), Error);
}

TEST_F(Grids, ChecksBinaryHeaders) {
  const auto refused = [&](const std::string& header, const std::string& why) {
    put("a.bil", std::string(100, '\0'));
    put("a.hdr", header);
    const std::string text = refusal_of(path("a.bil"));
    EXPECT_NE(text.find(why), std::string::npos) << header << '\n' << text;
  };
  refused("", "ncols: is missing");
  refused("ncols 10\nnrows 11\n", "has 100 bytes, too few");
  refused("ncols 1000000000\nnrows 1000000000\n", "has 100 bytes, too few");
  refused("ncols 1e18\nnrows 10\n", "not a count");
  refused("ncols 1073741824\nnrows 10\n", "fewer than 2^30");
  refused("ncols 0\nnrows 10\n", "at least 1");
  refused("ncols -3\nnrows 10\n", "not a count");
  refused("ncols 10\nnrows 10\nnbits 12\n", "is 12, which is not supported");
  refused("ncols 10\nnrows 10\nnbits 32\npixeltype x\n", "too few");
  refused("ncols 10\nnrows 10\nnbands 65536\n", "nbands");
  refused("ncols 10\nnrows 10\nlayout spiral\n", "not BIL, BIP or BSQ");
  refused("ncols 10\nnrows 10\nbyteorder x\n", "byteorder");
  refused("ncols 10\nnrows 10\ntotalrowbytes 3\n", "is less than the size of a row");
  refused("ncols 10\nnrows 10\nbandrowbytes 9007199254740991\nnbands 2\n", "too few");
  refused("ncols 10\nnrows 10\nbandrowbytes 9007199254740991\nnbands 65535\n", "is too large");
  refused("ncols 10\nnrows 10\nskipbytes 9007199254740991\n", "too few");
  refused("ncols 10\nnrows 10\nulxmap 3\n", "yllcorner: is missing");
  refused("ncols 10\nnrows 10\nulxmap nan\nulymap 1\n", "not a number");
  refused("ncols 10\nnrows 10\ncellsize 0\nulxmap 1\nulymap 1\n", "not positive");
  EXPECT_NE(refusal_of(put("b.flt", "1234")).find("has no header file next to it"),
            std::string::npos);
}

TEST_F(Grids, SrtmTilesMatchGdal) {
  if (!has_gdal()) GTEST_SKIP() << "no gdal-bin";
  make_tiff("a.tif", 1201, 1201,
            "-a_srs EPSG:4326 -a_ullr -125.00041666666667 49.000416666666667 -123.99958333333333 "
            "47.999583333333333");
  run("gdal_translate -q -of SRTMHGT a.tif N48W125.hgt");
  expect_same(*open_hgt(path("N48W125.hgt")), *open_geotiff(path("a.tif")));
  const auto source = open_one(path("N48W125.hgt"));
  EXPECT_EQ(source->info().format, "hgt");
  EXPECT_EQ(source->info().crs.epsg, 4326);
  EXPECT_EQ(source->info().crs.vertical_epsg, 5773);
  EXPECT_EQ(source->info().nodata, -32768);
  run("gzip -kn N48W125.hgt");
  expect_same(*open_hgt(path("N48W125.hgt.gz")), *open_geotiff(path("a.tif")));
  EXPECT_EQ(open_one(path("N48W125.hgt.gz"))->info().format, "hgt");
}

/// A square tile of side n, sample = column + 100 * row, with a void in the middle.
std::string tile_of(int columns, int rows) {
  std::string bytes;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int value = r == rows / 2 && c == columns / 2 ? -32768 : c + 100 * r;
      bytes += static_cast<char>(value >> 8);
      bytes += static_cast<char>(value & 0xFF);
    }
  }
  return bytes;
}

TEST_F(Grids, PlacesTilesByTheirName) {
  const auto corner = [&](const std::string& name) {
    const RasterInfo info = open_hgt(put(name, tile_of(11, 11)))->info();
    return std::array<double, 2>{info.world.xy[2], info.world.xy[5] + 10 * info.world.xy[4]};
  };
  EXPECT_EQ(corner("N46E008.hgt"), (std::array<double, 2>{8, 46}));
  EXPECT_EQ(corner("s01w180.SRTMGL1.HGT"), (std::array<double, 2>{-180, -1}));
  EXPECT_EQ(corner("N00E011.hgt"), (std::array<double, 2>{11, 0}));
  for (const char* name : {"N46E08.hgt", "N461E008.hgt", "X46E008.hgt", "N91E008.hgt",
                           "N46E181.hgt", "N46E0081.hgt", "tile.hgt"}) {
    EXPECT_NE(refusal_of(put(name, tile_of(11, 11))).find("does not give its south-west corner"),
              std::string::npos)
        << name;
  }
  const RasterInfo half = open_hgt(put("N62E010.hgt", tile_of(1801, 3601)))->info();
  EXPECT_EQ(half.columns, 1801u);
  EXPECT_EQ(half.rows, 3601u);
  EXPECT_EQ(half.world.xy[0], 1.0 / 1800);
  EXPECT_NE(refusal_of(put("N01E001.hgt", tile_of(11, 10))).find("not a square of 16-bit samples"),
            std::string::npos);
  EXPECT_NE(refusal_of(put("N01E001.hgt", "12")).find("not a square"), std::string::npos);
  EXPECT_NE(refusal_of(put("N01E001.hgt", tile_of(11, 11)), {.band = 2}).find("no band 2"),
            std::string::npos);
}

TEST_F(Grids, ReadsTilesInArchives) {
  if (std::system("command -v zip >/dev/null 2>&1") != 0) GTEST_SKIP() << "no zip";
  put("N46E008.hgt", tile_of(11, 11));
  run("zip -q N46E008.SRTMGL1.hgt.zip N46E008.hgt && zip -q other.zip N46E008.hgt");
  for (const char* name : {"N46E008.SRTMGL1.hgt.zip", "other.zip"}) {
    expect_same(*open_hgt(path(name)), *open_hgt(path("N46E008.hgt")));
    EXPECT_EQ(open_one(path(name))->info().format, "hgt");
  }
  // Another file comes first, so only the name shows the format.
  put("readme.txt", "1 2 3\n");
  run("zip -q N46E008.hgt.zip readme.txt N46E008.hgt");
  EXPECT_EQ(open_one(path("N46E008.hgt.zip"))->info().columns, 11u);

  put("N47E008.hgt", tile_of(11, 11));
  run("zip -q none.hgt.zip readme.txt");
  EXPECT_NE(refusal_of(path("none.hgt.zip")).find("no .hgt file"), std::string::npos);
  run("zip -q -P secret locked.zip N46E008.hgt");
  EXPECT_NE(refusal_of(path("locked.zip")), "");
  // A mosaic of two tiles shares a row.
  run("zip -q N47E008.zip N47E008.hgt");
  const std::vector<std::string> both{path("N46E008.hgt.zip"), path("N47E008.zip")};
  const auto source = open_source(both);
  EXPECT_EQ(source->info().columns, 11u);
  EXPECT_EQ(source->info().rows, 21u);
  PointBlock block;
  std::size_t points = 0;
  while (source->next(block)) points += block.size();
  EXPECT_EQ(points, 11u * 21 - 2);
}

/// The oracle is the mosaic of the unpacked files.
TEST_F(Grids, ReadsArchivesOfSeveralTilesAsMosaics) {
  if (std::system("command -v zip >/dev/null 2>&1") != 0) GTEST_SKIP() << "no zip";
  fs::create_directory(path("srtm"));
  std::vector<std::string> files;
  for (const char* name : {"N46E008", "N47E008", "N46E009", "N48E010"}) {
    files.push_back(put("srtm/" + std::string(name) + ".hgt", tile_of(11, 11)));
  }
  put("srtm/readme.txt", "1 2 3\n");
  run("zip -q srtm.zip srtm srtm/readme.txt && "
      "zip -q srtm.zip srtm/N46E008.hgt srtm/N47E008.hgt srtm/N46E009.hgt srtm/N48E010.hgt");
  const auto read = [](std::vector<std::string> names, SourceOptions options = {}) {
    const auto source = open_source(names, options);
    EXPECT_EQ(source->info().format, "hgt");
    std::vector<Point3> points;
    for (PointBlock block; source->next(block);) {
      for (const Point3& p : block.positions) points.push_back(world_point(source->info(), p));
    }
    std::sort(points.begin(), points.end());
    return points;
  };
  const std::vector<Point3> wanted = read(files);
  EXPECT_EQ(wanted.size(), 4u * 11 * 11 - 4 - 2 * 11);
  EXPECT_EQ(read({path("srtm.zip")}), wanted);
  EXPECT_EQ(open_one(path("srtm.zip"))->info().files, std::vector<std::string>{path("srtm.zip")});
  SourceOptions part;
  part.selection.region = Box3{{8.5, 46.5, -1e9}, {9.5, 46.7, 1e9}};
  EXPECT_EQ(read({path("srtm.zip")}, part), read(files, part));

  // With another archive and an unpacked file.
  run("zip -q more.zip srtm/N46E009.hgt srtm/N48E010.hgt && zip -q first.zip srtm/N46E008.hgt");
  EXPECT_EQ(read({path("first.zip"), path("srtm/N47E008.hgt"), path("more.zip")}), wanted);

  // Errors name tiles of another size or without a place.
  put("srtm/N50E008.hgt", tile_of(21, 21));
  run("zip -q sizes.zip srtm/N46E008.hgt srtm/N50E008.hgt");
  EXPECT_NE(refusal_of(path("sizes.zip")).find("sizes.zip/srtm/N50E008.hgt"), std::string::npos);
  put("srtm/tile.hgt", tile_of(11, 11));
  run("zip -q place.zip srtm/N46E008.hgt srtm/tile.hgt");
  EXPECT_NE(refusal_of(path("place.zip")).find("srtm/tile.hgt"), std::string::npos);
}

/// The directory of an archive with very many tiles is read once, not once per tile.
TEST_F(Grids, ReadsArchivesOfVeryManyTilesOnce) {
  if (std::system("command -v python3 >/dev/null 2>&1") != 0) GTEST_SKIP() << "no python3";
  const auto bytes_read = [] {  // by this process so far, from any file
    std::ifstream io("/proc/self/io");
    std::string name;
    std::uint64_t value = 0;
    while (io >> name >> value)
      if (name == "rchar:") return value;
    return std::uint64_t{0};
  };
  if (bytes_read() == 0) GTEST_SKIP() << "no /proc/self/io";
  std::ofstream(path("make.py")) << "import zipfile\n"
                                    "with zipfile.ZipFile('many.zip', 'w') as archive:\n"
                                    "    for i in range("
                                 << 5000 / TERRACE_TEST_SHARE
                                 << "):\n"
                                    "        archive.writestr(f'{i}/N46E008.hgt', bytes(8))\n";
  run("python3 make.py");
  const std::uint64_t before = bytes_read();
  const auto source = open_one(path("many.zip"));
  PointBlock block;
  ASSERT_TRUE(source->next(block));
  EXPECT_EQ(block.size(), 4u);
  EXPECT_LT(bytes_read() - before, 100 * fs::file_size(path("many.zip")));
}

TEST_F(Grids, RejectsDamagedArchives) {
  if (std::system("command -v zip >/dev/null 2>&1") != 0) GTEST_SKIP() << "no zip";
  put("N46E008.hgt", tile_of(101, 101));
  run("zip -q a.zip N46E008.hgt && gzip -kn N46E008.hgt");
  for (const std::string name : {"a.zip", "N46E008.hgt.gz"}) {
    std::ifstream file(path(name), std::ios::binary);
    const std::string good{std::istreambuf_iterator<char>(file), {}};
    const auto bad = [&](const std::string& content) {
      return refusal_of(put("N46E008.hgt" + fs::path(name).extension().string(), content));
    };
    EXPECT_EQ(bad(good), "");
    for (std::size_t cut = 0; cut < good.size(); cut += 997)
      EXPECT_NE(bad(good.substr(0, cut)), "") << cut;
    std::size_t unnoticed = 0;
    for (std::size_t i = 0; i < good.size(); i += 131) {
      std::string wrong = good;
      wrong[i] = static_cast<char>(wrong[i] ^ 0x55);
      if (bad(wrong).empty()) ++unnoticed;
    }
    EXPECT_LT(unnoticed, 3u);  // times, attributes and the like
  }
}

TEST_F(Grids, AsciiGridsMatchWhatGdalConverted) {
  if (!has_gdal()) GTEST_SKIP() << "no gdal-bin";
  make_tiff("a.tif", 61, 37, "-a_ullr 500000 5200370 500610 5200000");
  run("gdal_translate -q -of AAIGrid a.tif a.asc");
  expect_same(*open_ascii_grid(path("a.asc")), *open_geotiff(path("a.tif")));
  EXPECT_EQ(open_one(path("a.asc"))->info().format, "ascii-grid");
  EXPECT_EQ(open_ascii_grid(path("a.asc"))->info().sample.type, ScalarType::f32);
  EXPECT_EQ(open_ascii_grid(path("a.asc"))->info().nodata, -32768);
  // Cells that are not square, and doubles that need all their bits.
  run("gdal_translate -q -ot Float64 -a_ullr 500000 5200370 500305 5200000 -scale -100 4000 0 1 "
      "a.tif b.tif");
  run("gdal_translate -q -of AAIGrid -co DECIMAL_PRECISION=17 -co FORCE_CELLSIZE=NO b.tif b.asc");
  expect_same(*open_ascii_grid(path("b.asc")), *open_geotiff(path("b.tif")));
  EXPECT_EQ(open_ascii_grid(path("b.asc"))->info().sample.type, ScalarType::f64);
}

TEST_F(Grids, ReadsAsciiGridsWithAnyLineBreaks) {
  const std::string head =
      "\xEF\xBB\xBFNCOLS 3\r\nnrows\t2\nXLLCENTER 10\nyllcorner 20\ncellsize 2\n";
  const std::vector<std::string> texts{head + "1 2 3\n4 5 6\n", head + "1\n2\r\n3 4 5\t6",
                                       head + "\n\n 1 2 3 4 5 6 \n \n",
                                       "dy 2\ndx 2\nnrows 2\nncols 3\nxllcorner 9\nyllcenter "
                                       "21\nprojection utm\n+1 2.0 3e0 4 5, 6\n"};
  for (const std::string& text : texts) {
    const WholeRaster whole = read_whole(*open_ascii_grid(put("a.asc", text)));
    EXPECT_EQ(whole.info.world.xy, (std::array<double, 6>{2, 0, 10, 0, -2, 23})) << text;
    for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(whole.value(i), static_cast<double>(i + 1));
  }
  // Decimal commas, numbers of any form, and nodata in any spelling.
  const WholeRaster odd = read_whole(*open_ascii_grid(put(
      "b.txt",
      "ncols 4\nnrows 2\nxllcorner 0,5\nyllcorner 0\ncellsize 1\nNODATA_value -3.40282346639e+38\n"
      "0,25 nan -3.4028234663852886e+38 inf\n-1e-400 0.5 -3.40282346639e+38 16777216\n")));
  EXPECT_EQ(odd.info.sample.type, ScalarType::f32);
  EXPECT_EQ(odd.info.world.xy[2], 1.0);
  EXPECT_EQ(odd.valid, (std::vector<std::uint8_t>{1, 0, 0, 0, 1, 1, 0, 1}));
  EXPECT_EQ(odd.value(0), 0.25);
  EXPECT_EQ(odd.value(7), 16777216);
  // The first number that is not exact as a float widens all.
  std::string many =
      "ncols 200\nnrows 300\nxllcorner 0\nyllcorner 0\ncellsize 1\nnodata_value "
      "-1.7976931348623157e+308\n";
  for (int i = 0; i < 60000; ++i) {
    many += i == 777 ? "-1.7976931348623157e+308 " : std::to_string(i) + (i == 50000 ? ".1 " : " ");
  }
  const std::string file = put("c.asc", many);
  const WholeRaster wide = read_whole(*open_ascii_grid(file));
  EXPECT_EQ(wide.info.sample.type, ScalarType::f64);
  EXPECT_EQ(type_of_ascii_grid(file), ScalarType::f64);
  for (std::size_t i = 0; i < 60000; ++i) {
    ASSERT_EQ(wide.valid[i], i == 777 ? 0 : 1);
    if (i == 777) continue;
    ASSERT_EQ(wide.value(i), i == 50000 ? 50000.1 : static_cast<double>(i));
  }
  expect_same(*open_ascii_grid(file, {}, ScalarType::f64), *open_ascii_grid(file));
}

TEST_F(Grids, ReadsWordsForNodata) {
  const std::string head = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n";
  const auto valid = [&](const std::string& nodata, const std::string& cells) {
    return read_whole(*open_ascii_grid(put("a.asc", head + nodata + cells))).valid;
  };
  const std::vector<std::uint8_t> first{0, 1, 1, 1, 1, 0};
  for (const char* const word : {"null", "NULL", "nan", "-nan", "1.#QNAN", "-1.#IND00", "1.#INF",
                                 "-1.#INF", "NA", "n/a", "nodata", "*"}) {
    const std::string cells = std::string(word) + " 2 3 4 5 " + word + "\n";
    EXPECT_EQ(valid("NODATA_value -9999\n", cells), first) << word;
    EXPECT_EQ(valid(std::string("NODATA_value ") + word + "\n", cells), first) << word;
    EXPECT_EQ(valid("", cells), first) << word;
  }
  // Any word that the header declares.
  EXPECT_EQ(valid("NODATA_value hole\n", "hole 2 3 4 5 hole"), first);
  EXPECT_NE(refusal_of(put("a.asc", head + "1 2 3 4 hole 6")).find("'hole' is not a number"),
            std::string::npos);
  EXPECT_NE(refusal_of(put("a.asc", head + "1 2 3 4 5.#X 6")), "");
  // Also in the header of a binary grid.
  std::vector<float> floats{1, 2, std::numeric_limits<float>::quiet_NaN()};
  put("b.flt", std::string(reinterpret_cast<const char*>(floats.data()), 12));
  for (const char* const word : {"nan", "null", "-1.#QNAN", "-9999"}) {
    put("b.hdr", std::string("ncols 3\nnrows 1\nnodata_value ") + word + "\n");
    EXPECT_EQ(read_whole(*open_binary_grid(path("b.flt"), {})).valid,
              (std::vector<std::uint8_t>{1, 1, 0}));
  }
}

TEST_F(Grids, GrassAsciiGridsMatchGdal) {
  const std::string head =
      "north: 4928010\nsouth: 4928000.5\neast: 609020\nwest: 609000\n"
      "rows: 3\ncols: 4\n";
  const std::string cells = "1 2 3 4\n5 6 7 8\n9 10 11.5 -12\n";
  const std::string file = put("g.asc", head + cells);
  if (has_gdal()) {
    run("gdal_translate -q -of GTiff g.asc g.tif");
    expect_same(*open_ascii_grid(file), *open_geotiff(path("g.tif")));
  }
  // By content, not by name.
  EXPECT_EQ(open_one(put("g.txt", head + cells))->info().format, "ascii-grid");
  const WholeRaster whole = read_whole(*open_ascii_grid(
      put("h.asc",
          "rows: 2\ncols: 3\nnorth: 45:30:36N\nsouth: 44.5S\neast: 3E\nwest: 3W\nnull: void\n"
          "type: float\nmultiplier: 0.5\nvoid 2 3\n4 * 6\n")));
  const std::array<double, 6> world{2, 0, -2, 0, -45.005, 23.0075};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(whole.info.world.xy[i], world[i], 1e-12);
  EXPECT_EQ(whole.info.sample.scale, 0.5);
  EXPECT_EQ(whole.valid, (std::vector<std::uint8_t>{0, 1, 1, 1, 0, 1}));
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"north: 4928010\n", ""},
           {"north: 4928010\n", "north: 4928000\n"},
           {"north: 4928010\n", "north: 45:\n"},
           {"north: 4928010\n", "north: 4:5:6:7N\n"},
           {"north: 4928010\n", "north: N\n"},
           {"cols: 4", "cols: 0"},
           {"cols: 4\n", ""},
           {"rows: 3\n", "rows: 3\nmultiplier: 0\n"}}) {
    std::string bad = head + cells;
    bad.replace(bad.find(from), from.size(), to);
    EXPECT_NE(refusal_of(put("b.asc", bad)), "") << to;
  }
}

TEST_F(Grids, JoinsAsciiGridsToMosaics) {
  const auto tile = [&](const std::string& name, int x, const std::string& numbers) {
    return put(name, "ncols 2\nnrows 2\nxllcorner " + std::to_string(x) +
                         "\nyllcorner 0\ncellsize 1\nnodata_value -9\n" + numbers);
  };
  const std::vector<std::string> files{tile("1.asc", 0, "1 2 3 4"), tile("2.asc", 2, "5 6.1 7 -9")};
  const auto source = open_source(files);
  EXPECT_EQ(source->info().columns, 4u);
  EXPECT_EQ(source->info().coordinates[2].type, ScalarType::f64);
  PointBlock block;
  ASSERT_TRUE(source->next(block));
  EXPECT_EQ(block.size(), 7u);
  EXPECT_FALSE(source->next(block));
}

TEST_F(Grids, TilesFollowTheShapeOfCells) {
  std::string text = "ncols 100\nnrows 100\ncellsize 1\n";
  for (int i = 0; i < 10000; ++i) text += std::to_string(i) + " ";
  const auto size_of_block = [&](double aspect) {
    const auto source = open_one(put("a.asc", text), {.block_points = 100, .blocks_ahead = 2});
    if (aspect > 0) source->refine(aspect, 64u << 20);
    PointBlock block;
    EXPECT_TRUE(source->next(block));
    Box3 box;
    for (const Point3& p : block.positions) box.include(p);
    return std::array<double, 2>{box.max[0] - box.min[0] + 1, box.max[1] - box.min[1] + 1};
  };
  EXPECT_EQ(size_of_block(0), (std::array<double, 2>{10, 10}));
  EXPECT_EQ(size_of_block(4), (std::array<double, 2>{20, 5}));
  EXPECT_EQ(size_of_block(0.25), (std::array<double, 2>{5, 20}));
}

TEST_F(Grids, RejectsDamagedAsciiGrids) {
  const std::string head = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 2\n";
  const std::vector<std::pair<std::string, std::string>> cases{
      {head + "1 2 3 4 5", "holds 5 numbers where 3 x 2 are expected"},
      {head + "1 2 3 4 5 6 7", "holds more numbers"},
      {head + "1 2 3 4 x 6", "row 1, column 1: 'x' is not a number"},
      {head + "1 2 3 4 1,2,3 6", "'1,2,3' is not a number"},
      {head + "1 2 3 4 5 6x", "'6x' is not a number"},
      {head, "holds 0 numbers"},
      {head + "1 2 3 " + std::string(100000, '4'), "1,024 characters"},
      {"ncols 1000000000\nnrows 1000000000\ncellsize 1\n1 2 3", "more than fit into"},
      {"ncols 2000000000\nnrows 1\ncellsize 1\n1 2 3", "fewer than 2^30"},
      {"ncols 3\nnrows 2\n1 2 3 4 5 6", "cellsize: is missing"},
      {"ncols 3\nnrows 2\ncellsize -1\n1 2 3 4 5 6", "not positive"},
      {"ncols 3\ncellsize 1\n1 2 3 4 5 6", "nrows: is missing"},
      {"ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\nbyteorder LSBFIRST\n",
       "name the .flt"},
      {"ncols", "ncols: is missing"}};
  for (const auto& [text, why] : cases) {
    EXPECT_NE(refusal_of(put("a.asc", text)).find(why), std::string::npos)
        << why << '\n'
        << refusal_of(path("a.asc"));
  }
  EXPECT_NE(refusal_of(put("a.asc", head + "1 2 3 4 5 6"), {.band = 2}).find("no band 2"),
            std::string::npos);
}

TEST_F(Grids, ReadsRealAsciiGrids) {
  const auto data = real_data();
  if (!data || !has_gdal()) GTEST_SKIP() << "no TERRACE_DATA or no gdal-bin";
  run("cp '" + (*data / "dem/encodings/ascii.asc.gz").string() +
      "' alps.asc.gz && gunzip -f alps.asc.gz");
  for (const std::string& file :
       {(*data / "dem/hugo_site.asc").string(), (*data / "dem/gdal/case_sensitive.ASC").string(),
        (*data / "dem/gdal/pixel_per_line.asc").string(),
        (*data / "dem/gdal/pixel_per_line_comma.asc").string(), path("alps.asc")}) {
    run("gdal_translate -q '" + file + "' real.tif");
    expect_same(*open_ascii_grid(file), *open_geotiff(path("real.tif")));
    EXPECT_EQ(open_one(file)->info().format, "ascii-grid");
  }
}

TEST_F(Grids, UsgsDemsMatchGdal) {
  if (!has_gdal()) GTEST_SKIP() << "no gdal-bin";
  const auto check = [&](const std::string& file) {
    run("gdal_translate -q '" + file + "' back.tif");
    expect_same(*open_usgs_dem(file), *open_geotiff(path("back.tif")));
    EXPECT_EQ(open_one(file)->info().format, "usgs-dem");
  };
  make_tiff("a.tif", 121, 137, "-a_srs EPSG:26910 -a_ullr 500000 5204110 503630 5200000");
  run("gdal_translate -q -of USGSDEM a.tif utm.dem");
  check(path("utm.dem"));
  const RasterInfo utm = open_usgs_dem(path("utm.dem"))->info();
  EXPECT_EQ(utm.crs.epsg, 26910);
  EXPECT_EQ(utm.sample.unit, "metre");
  run("gdal_translate -q -a_srs EPSG:4269 -a_ullr -120.00041666666667 40.00041666666667 "
      "-119.89958333333333 39.88625 a.tif b.tif");
  run("gdal_translate -q -of USGSDEM b.tif degrees.dem");
  check(path("degrees.dem"));
  EXPECT_EQ(open_usgs_dem(path("degrees.dem"))->info().crs.epsg, 4269);
  EXPECT_TRUE(open_usgs_dem(path("degrees.dem"))->info().crs.geographic);
  run("gdal_translate -q -of USGSDEM -co ZRESOLUTION=0.1 b.tif fine.dem");
  check(path("fine.dem"));
  if (const auto data = real_data()) {
    check((*data / "dem/SainteHelens.dem").string());
    check((*data / "dem/gdal/record_1025_ending_with_linefeed.dem").string());
    EXPECT_EQ(open_usgs_dem((*data / "dem/SainteHelens.dem").string())->info().crs.epsg, 26710);
  }
}

TEST_F(Grids, RejectsDamagedUsgsDems) {
  if (!has_gdal()) GTEST_SKIP() << "no gdal-bin";
  make_tiff("a.tif", 31, 37, "-a_srs EPSG:26910 -a_ullr 500000 5201110 500930 5200000");
  run("gdal_translate -q -of USGSDEM a.tif a.dem");
  std::ifstream file(path("a.dem"), std::ios::binary);
  const std::string good{std::istreambuf_iterator<char>(file), {}};
  for (std::size_t cut = 0; cut < 31 * 1024; cut += 331) {
    EXPECT_NE(refusal_of(put("b.dem", good.substr(0, cut))), "") << cut;
  }
  const auto with = [&](std::size_t at, const std::string& text) {
    std::string wrong = good;
    wrong.replace(at, text.size(), text);
    return refusal_of(put("b.dem", wrong));
  };
  EXPECT_EQ(with(0, "X"), "");
  EXPECT_NE(with(858, "999999").find("ends before"), std::string::npos);
  EXPECT_NE(with(858, "     0"), "");
  EXPECT_NE(with(546 + 3 * 24, "    9.0D+99             ").find("no rows, or too many"),
            std::string::npos);
  EXPECT_NE(with(816, "0.000000E+00").find("not positive"), std::string::npos);
  EXPECT_NE(with(816, "         nan"), "");
  EXPECT_NE(with(1024 + 12, "     x").find("is not a number of samples"), std::string::npos);
  EXPECT_NE(with(1024 + 12, "999999"), "");
}

TEST_F(Grids, HeightMapsMatchWhatGdalConverted) {
  if (!has_gdal()) GTEST_SKIP() << "no gdal-bin";
  make_tiff("a.tif", 61, 37, "-a_ullr 500000 5200370 500610 5200000");
  for (const std::string type : {"Byte", "UInt16"}) {
    run("gdal_translate -q -ot " + type + " -a_nodata 77 a.tif b.tif");
    run("rm -f b.pgw b.wld && gdal_translate -q -of PNG -co WORLDFILE=YES b.tif b.png");
    expect_same(*open_height_map(path("b.png")), *open_geotiff(path("b.tif")));
    EXPECT_EQ(open_one(path("b.png"))->info().format, "png");
  }
  run("rm b.wld");
  const RasterInfo plain = open_height_map(path("b.png"))->info();
  EXPECT_EQ(plain.world.xy, (std::array<double, 6>{1, 0, 0, 0, -1, 0}));
  ASSERT_EQ(plain.comments.size(), 1u);
  put("b.pgw", "10\n0\n0\n-10\n500005\n");
  EXPECT_NE(refusal_of(path("b.png")).find("six numbers"), std::string::npos);
  put("b.pgw", "10\n0\n0\nnan\n500005\n5\n");
  EXPECT_NE(refusal_of(path("b.png")).find("six numbers"), std::string::npos);
  put("b.pgw", "0\n0\n0\n0\n500005\n5\n");
  EXPECT_NE(refusal_of(path("b.png")).find("distinct places"), std::string::npos);
  EXPECT_NE(refusal_of(path("b.png"), {.heights_of_colour = HeightsOfColour::mapbox})
                .find("no 8-bit colours"),
            std::string::npos);
}

/// Writes a PNG of any kind with libpng.
void write_any_png(const std::string& file, std::uint32_t columns, std::uint32_t rows, int bits,
                   int colour_type, bool interlaced, const std::vector<std::uint8_t>& bytes) {
  FILE* const out = std::fopen(file.c_str(), "wb");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, out);
  png_set_IHDR(png, info, columns, rows, bits, colour_type,
               interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  if (colour_type == PNG_COLOR_TYPE_PALETTE) {
    const png_color colours[2] = {{1, 134, 160}, {2, 0, 0}};
    png_set_PLTE(png, info, colours, 2);
  }
  png_write_info(png, info);
  std::vector<png_bytep> lines(rows);
  for (std::uint32_t row = 0; row < rows; ++row) {
    lines[row] = const_cast<png_bytep>(bytes.data()) + row * (bytes.size() / rows);
  }
  png_write_image(png, lines.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  std::fclose(out);
}

TEST_F(Grids, ReadsHeightMapsOfEveryKind) {
  std::vector<std::uint8_t> bytes(23 * 19 * 2);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * 37 >> 2);
  write_any_png(path("plain.png"), 23, 19, 16, PNG_COLOR_TYPE_GRAY, false, bytes);
  write_any_png(path("laced.png"), 23, 19, 16, PNG_COLOR_TYPE_GRAY, true, bytes);
  expect_same(*open_height_map(path("laced.png")), *open_height_map(path("plain.png")));
  const WholeRaster whole = read_whole(*open_height_map(path("plain.png")));
  for (std::size_t i = 0; i < whole.cells(); ++i) {
    ASSERT_EQ(whole.as<std::uint16_t>(i), bytes[2 * i] << 8 | bytes[2 * i + 1]);
  }
  write_any_png(path("nibbles.png"), 4, 1, 4, PNG_COLOR_TYPE_GRAY, false, {0x1F, 0x03});
  const WholeRaster nibbles = read_whole(*open_height_map(path("nibbles.png")));
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(nibbles.value(i), (std::array<double, 4>{1, 15, 0, 3})[i]);
  EXPECT_EQ(nibbles.info.sample.type, ScalarType::u8);
  write_any_png(path("alpha.png"), 2, 1, 8, PNG_COLOR_TYPE_GRAY_ALPHA, false, {1, 2, 3, 4});
  EXPECT_NE(refusal_of(path("alpha.png")).find("colour picture"), std::string::npos);
}

TEST_F(Grids, DecodesHeightsFromColoursOnRequest) {
  const RasterOptions mapbox{.heights_of_colour = HeightsOfColour::mapbox};
  const RasterOptions terrarium{.heights_of_colour = HeightsOfColour::terrarium};
  const auto heights = [&](const RasterOptions& options) {
    const WholeRaster whole = read_whole(*open_height_map(path("a.png"), options));
    std::vector<double> out;
    for (std::size_t i = 0; i < whole.cells(); ++i) {
      out.push_back(whole.valid[i] == 0
                        ? -1e9
                        : whole.value(i) * whole.info.sample.scale + whole.info.sample.offset);
    }
    return out;
  };
  write_any_png(path("a.png"), 2, 1, 8, PNG_COLOR_TYPE_RGB, false, {1, 134, 160, 1, 134, 161});
  EXPECT_NE(refusal_of(path("a.png")).find("`heights_of_colour`"), std::string::npos);
  EXPECT_EQ(heights(mapbox), (std::vector<double>{0, 100001 * 0.1 - 10000}));
  EXPECT_EQ(heights(terrarium), (std::vector<double>{256 + 134 + 160 / 256.0 - 32768,
                                                     256 + 134 + 161 / 256.0 - 32768}));
  for (const bool laced : {false, true}) {
    write_any_png(path("a.png"), 2, 1, 8, PNG_COLOR_TYPE_RGB_ALPHA, laced,
                  {1, 134, 160, 0, 1, 134, 160, 255});
    EXPECT_EQ(heights(mapbox), (std::vector<double>{-1e9, 0}));
  }
  write_any_png(path("a.png"), 2, 1, 8, PNG_COLOR_TYPE_PALETTE, false, {0, 1});
  EXPECT_EQ(heights(mapbox), (std::vector<double>{0, 131072 * 0.1 - 10000}));
  const SourceOptions options{.heights_of_colour = HeightsOfColour::mapbox};
  EXPECT_EQ(open_one(path("a.png"), options)->info().coordinates[2].scale, 0.1);
  EXPECT_NE(refusal_of(put("a.xyz", "1 2 3\n"), options).find("as colours"), std::string::npos);
  if (const auto data = real_data()) {
    const WholeRaster fuji =
        read_whole(*open_height_map((*data / "dem/fuji_terrainrgb_512.png").string(), mapbox));
    double low = 1e9, high = -1e9;
    for (std::size_t i = 0; i < fuji.cells(); ++i) {
      low = std::min(low, fuji.value(i) * 0.1 - 10000);
      high = std::max(high, fuji.value(i) * 0.1 - 10000);
    }
    EXPECT_NEAR(low, 13.7, 1e-6);
    EXPECT_NEAR(high, 3751.0, 1e-6);
  }
}

TEST_F(Grids, RejectsDamagedHeightMaps) {
  std::vector<std::uint8_t> bytes(64 * 64);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * i >> 3);
  write_any_png(path("good.png"), 64, 64, 8, PNG_COLOR_TYPE_GRAY, true, bytes);
  std::ifstream file(path("good.png"), std::ios::binary);
  const std::string good{std::istreambuf_iterator<char>(file), {}};
  for (std::size_t cut = 0; cut + 1 < good.size(); cut += 29) {
    EXPECT_NE(refusal_of(put("a.png", good.substr(0, cut))), "") << cut;
  }
  for (std::size_t i = 0; i < good.size(); i += 31) {
    std::string wrong = good;
    wrong[i] = static_cast<char>(wrong[i] ^ 0x10);
    EXPECT_NE(refusal_of(put("a.png", wrong)), "") << i;
  }
  // Very wide and very high empty pictures with correct checksums.
  for (const auto& [columns, rows] :
       {std::pair(1u << 29, 1u), std::pair(1u, 1u << 29), std::pair(1u << 29, 1u << 29)}) {
    FILE* const out = std::fopen(path("b.png").c_str(), "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, out);
    png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_IHDR(png, info, columns, rows, 8, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    png_destroy_write_struct(&png, &info);
    std::fclose(out);
    std::ofstream(path("b.png"), std::ios::app | std::ios::binary)
        << std::string("\0\0\0\x0aIDAT\x78\x9c\x63\x60\x00\x00\x00\x02\x00\x01", 18);
    EXPECT_NE(refusal_of(path("b.png")).find("do not fit into"), std::string::npos);
  }
}

TEST_F(Grids, ReadsRealTiles) {
  const auto data = real_data();
  if (!data || !has_gdal()) GTEST_SKIP() << "no TERRACE_DATA or no gdal-bin";
  for (const char* name : {"N00E011", "N41E001", "N42E001", "N43E007", "N48W125", "N52E008"}) {
    const std::string zip = (*data / "dem" / "srtm" / (std::string(name) + ".hgt.zip")).string();
    run("gdal_translate -q '/vsizip/" + zip + "/" + name + ".hgt' " + name + ".tif");
    expect_same(*open_hgt(zip), *open_geotiff(path(std::string(name) + ".tif")));
  }
}

}  // namespace
}  // namespace terrace::stream
