// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "format/grid/rasters.hpp"
#include "grid_testing.hpp"

namespace terrace::stream {
namespace {

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

/// Returns a square tile of side n, sample = column + 100 * row, with a void in the middle.
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
  std::filesystem::create_directory(path("srtm"));
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
  const std::vector<Point3> expected = read(files);
  EXPECT_EQ(expected.size(), 4u * 11 * 11 - 4 - 2 * 11);
  EXPECT_EQ(read({path("srtm.zip")}), expected);
  EXPECT_EQ(open_one(path("srtm.zip"))->info().files, std::vector<std::string>{path("srtm.zip")});
  SourceOptions part;
  part.selection.region = Box3{{8.5, 46.5, -1e9}, {9.5, 46.7, 1e9}};
  EXPECT_EQ(read({path("srtm.zip")}, part), read(files, part));

  // With another archive and an unpacked file.
  run("zip -q more.zip srtm/N46E009.hgt srtm/N48E010.hgt && zip -q first.zip srtm/N46E008.hgt");
  EXPECT_EQ(read({path("first.zip"), path("srtm/N47E008.hgt"), path("more.zip")}), expected);

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
  const std::uint64_t initial = bytes_read();
  const auto source = open_one(path("many.zip"));
  PointBlock block;
  ASSERT_TRUE(source->next(block));
  EXPECT_EQ(block.size(), 4u);
  EXPECT_LT(bytes_read() - initial, 100 * std::filesystem::file_size(path("many.zip")));
}

TEST_F(Grids, RejectsDamagedArchives) {
  if (std::system("command -v zip >/dev/null 2>&1") != 0) GTEST_SKIP() << "no zip";
  put("N46E008.hgt", tile_of(101, 101));
  run("zip -q a.zip N46E008.hgt && gzip -kn N46E008.hgt");
  for (const std::string name : {"a.zip", "N46E008.hgt.gz"}) {
    std::ifstream file(path(name), std::ios::binary);
    const std::string good{std::istreambuf_iterator<char>(file), {}};
    const auto bad = [&](const std::string& content) {
      return refusal_of(
          put("N46E008.hgt" + std::filesystem::path(name).extension().string(), content));
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
