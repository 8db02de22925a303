// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "format/grid/binary.hpp"
#include "format/grid/rasters.hpp"
#include "grid_testing.hpp"

namespace terrace::stream {
namespace {

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
  std::string text =
      "ncols 200\nnrows 300\nxllcorner 0\nyllcorner 0\ncellsize 1\nnodata_value "
      "-1.7976931348623157e+308\n";
  for (int i = 0; i < 60000; ++i) {
    text += i == 777 ? "-1.7976931348623157e+308 " : std::to_string(i) + (i == 50000 ? ".1 " : " ");
  }
  const std::string file = put("c.asc", text);
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

}  // namespace
}  // namespace terrace::stream
