// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "gdal_tools.hpp"
#include "point_files.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "tiff_writing.hpp"

/// Virtual rasters, compared with the GeoTIFFs to which GDAL converts them.

namespace terrace::stream {
namespace {

std::vector<Point3> sorted_cells(AllPoints all) {
  std::sort(all.points.positions.begin(), all.points.positions.end());
  return std::move(all.points.positions);
}

class Vrt : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_.path() / name).string();
  }
  /// A GeoTIFF of random samples below `limit`. nodata: its tag, if not empty.
  void put_tiff(const std::string& name, std::int64_t column, std::int64_t row,
                std::uint32_t columns, std::uint32_t rows, const std::string& nodata, int limit,
                std::mt19937_64& random) const {
    TiffSpec spec;
    spec.columns = columns;
    spec.rows = rows;
    if (random() % 2 == 0) spec.tile_columns = spec.tile_rows = 16;
    const auto place = placed_at(1000 + 10 * static_cast<double>(column),
                                 5000 - 10 * static_cast<double>(row), 10);
    spec.more = [&](TIFF* tiff) {
      place(tiff);
      if (!nodata.empty()) TIFFSetField(tiff, 42113, nodata.c_str());
    };
    std::vector<std::int16_t> values(std::size_t{columns} * rows);
    for (std::int16_t& value : values) {
      value = static_cast<std::int16_t>(random() % static_cast<unsigned>(limit));
    }
    write_tiff(path(name), spec, as_samples(values));
  }
  [[nodiscard]] std::string put_vrt(const std::string& band, const std::string& more = {},
                                    const std::string& attributes = {}) const {
    return write_text(path("a.vrt"),
                      "<VRTDataset rasterXSize=\"20\" rasterYSize=\"10\"" + attributes +
                          ">\n<GeoTransform> 1.0e3, 10, 0, 5000, 0, -10</GeoTransform>" + more +
                          "<VRTRasterBand dataType=\"Int16\" band=\"1\">" + band +
                          "</VRTRasterBand></VRTDataset>\n");
  }
  [[nodiscard]] static std::string source(const std::string& more,
                                          const std::string& name = "a.tif") {
    return "<SimpleSource><SourceFilename relativeToVRT=\"1\">" + name +
           "</SourceFilename><SourceBand>1</SourceBand>" + more + "</SimpleSource>";
  }
  [[nodiscard]] static std::string rects(const std::string& source_rect,
                                         const std::string& target_rect) {
    return "<SrcRect " + source_rect + "/><DstRect " + target_rect + "/>";
  }
  TempFolder folder_;
};

TEST_F(Vrt, CellsMatchGdal) {
  if (!has_gdal()) GTEST_SKIP() << "no GDAL here";
  for (std::uint64_t seed = 1; seed <= 24 / TERRACE_TEST_SHARE; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    const bool own_nodata = random() % 2 == 0;
    std::string files;
    const std::size_t count = 1 + random() % 5;
    for (std::size_t i = 0; i < count; ++i) {
      const std::string name = "t" + std::to_string(i) + ".tif";
      put_tiff(name, static_cast<std::int64_t>(random() % 60),
               static_cast<std::int64_t>(random() % 60),
               1 + static_cast<std::uint32_t>(random() % 50),
               1 + static_cast<std::uint32_t>(random() % 50), own_nodata ? "3" : "", 9, random);
      files += " '" + path(name) + "'";
    }
    // Nodata: none, those of the files, one for all, another in the VRT, only in the VRT.
    const std::vector<std::string> ways{"", "-srcnodata 4", "-srcnodata 4 -vrtnodata 4",
                                        "-srcnodata 4 -vrtnodata -7", "-vrtnodata 5"};
    std::string options = ways[random() % ways.size()];
    if (random() % 2 == 0) options += " -te 1100 4600 1550 4950";
    const std::string vrt = path("a.vrt"), tif = path("whole.tif");
    ASSERT_EQ(std::system(("gdalbuildvrt -q -overwrite " + options + " '" + vrt + "'" + files +
                           " >/dev/null 2>&1")
                              .c_str()),
              0);
    ASSERT_EQ(
        std::system(("gdal_translate -q '" + vrt + "' '" + tif + "' >/dev/null 2>&1").c_str()), 0);
    const AllPoints expected = read_file(tif);
    AllPoints result = read_file(vrt, {.block_points = 1 + random() % 500});
    EXPECT_EQ(result.info.format, "vrt");
    EXPECT_EQ(result.info.columns, expected.info.columns);
    EXPECT_EQ(result.info.rows, expected.info.rows);
    EXPECT_EQ(result.info.world.xy, expected.info.world.xy);
    // Cells without a source are 0 in GDAL if the VRT has no nodata value; here they have no data.
    std::vector<Point3> all = sorted_cells(expected), others = sorted_cells(std::move(result));
    if (expected.info.nodata) {
      EXPECT_EQ(others, all) << options;
    } else {
      std::erase_if(all, [](const Point3& cell) { return cell[2] == 0; });
      std::erase_if(others, [](const Point3& cell) { return cell[2] == 0; });
      EXPECT_EQ(others, all) << options;
    }
  }
}

TEST_F(Vrt, ItsNodataOverridesThatOfItsFiles) {
  std::mt19937_64 random(11);
  put_tiff("a.tif", 0, 0, 20, 10, "3", 9, random);
  random.seed(11);
  put_tiff("all.tif", 0, 0, 20, 10, "", 9, random);
  const auto cells = [&](const std::string& file) { return sorted_cells(read_file(file)); };
  const std::vector<Point3> all = cells(path("all.tif"));
  ASSERT_EQ(all.size(), 200U);
  const auto without = [&](double value) {
    std::vector<Point3> others = all;
    std::erase_if(others, [&](const Point3& cell) { return cell[2] == value; });
    return others;
  };
  const std::string body = "<SourceFilename relativeToVRT=\"1\">a.tif</SourceFilename>";
  // As gdalbuildvrt -srcnodata 5 writes it, with and without a nodata value of the VRT.
  const std::string complex = "<ComplexSource>" + body + "<NODATA>5</NODATA></ComplexSource>";
  EXPECT_EQ(cells(put_vrt("<NoDataValue>5</NoDataValue>" + complex)), without(5));
  EXPECT_EQ(cells(put_vrt(complex)), without(5));
  // As gdal_translate -a_nodata 5 writes it.
  EXPECT_EQ(cells(put_vrt("<NoDataValue>5</NoDataValue>" + source(""))), without(5));
  // Without any, those of the files are used, and a note says so.
  const AllPoints undeclared = read_file(put_vrt(source("")));
  EXPECT_EQ(sorted_cells(undeclared), without(3));
  EXPECT_NE(undeclared.info.note.find("a.tif, 3, is used"), std::string::npos)
      << undeclared.info.note;
  EXPECT_EQ(read_file(put_vrt(complex)).info.note, "");
}

TEST_F(Vrt, MovesSlightlyMisalignedSourcesToTheNearestCells) {
  if (!has_gdal()) GTEST_SKIP() << "no GDAL here";
  std::mt19937_64 random(12);
  put_tiff("a.tif", 0, 0, 20, 10, "", 99, random);
  for (const auto& [source_rect, target_rect] : std::vector<std::pair<std::string, std::string>>{
           {"xOff='0' yOff='0' xSize='9' ySize='7'",
            "xOff='3.003' yOff='2.003' xSize='9' ySize='7'"},
           {"xOff='2.01' yOff='0' xSize='9' ySize='7'",
            "xOff='3' yOff='-0.02' xSize='9.001' ySize='7'"}}) {
    const std::string vrt =
        put_vrt("<NoDataValue>-1</NoDataValue>" + source(rects(source_rect, target_rect)));
    ASSERT_EQ(
        std::system(("gdal_translate -q '" + vrt + "' '" + path("whole.tif") + "' >/dev/null 2>&1")
                        .c_str()),
        0);
    const AllPoints result = read_file(vrt);
    // GDAL also fills the cells that a source only touches.
    const std::vector<Point3> cells = sorted_cells(result);
    const std::vector<Point3> all = sorted_cells(read_file(path("whole.tif")));
    EXPECT_EQ(cells.size(), 63U);
    EXPECT_TRUE(std::includes(all.begin(), all.end(), cells.begin(), cells.end()));
    EXPECT_NE(result.info.note.find("nearest"), std::string::npos) << result.info.note;
  }
  const std::string full = "xOff='1' yOff='0' xSize='9' ySize='7'";
  EXPECT_EQ(read_file(put_vrt(source(rects(full, full)))).info.note, "");
}

TEST_F(Vrt, ReadsACodeAsCrs) {
  std::mt19937_64 random(13);
  put_tiff("a.tif", 0, 0, 20, 10, "", 99, random);
  const auto crs = [&](const std::string& text) {
    return read_file(put_vrt(source(""), "<SRS>" + text + "</SRS>")).info.crs;
  };
  EXPECT_EQ(crs("EPSG:32632").epsg, 32632);
  EXPECT_EQ(crs("\n epsg:25832+7837 ").epsg, 25832);
  EXPECT_EQ(crs("EPSG:25832+7837").vertical_epsg, 7837);
  // Other notations are kept as WKT.
  for (const char* const text :
       {"EPSG:", "EPSG:12x", "EPSG:1+", "EPSG:99999999999", "ESRI:54030"}) {
    EXPECT_EQ(crs(text).wkt, text);
    EXPECT_EQ(crs(text).epsg, 0);
  }
}

TEST_F(Vrt, ReadsPartsOfSourcesScaleAndOffset) {
  std::mt19937_64 random(7);
  put_tiff("a.tif", 0, 0, 12, 10, "", 99, random);
  const std::vector<Point3> full = sorted_cells(read_file(path("a.tif")));
  const std::string file = put_vrt(
      "<NoDataValue>5</NoDataValue><Scale>0.5</Scale><Offset>100</Offset><UnitType>m</UnitType>" +
      source(rects("xOff='2' yOff='1' xSize='7' ySize='6'",
                   "xOff='11' yOff='3' xSize='7' ySize='6'")));
  const AllPoints all = read_file(file);
  EXPECT_EQ(all.info.coordinates[2].scale, 0.5);
  EXPECT_EQ(all.info.coordinates[2].offset, 100);
  EXPECT_EQ(all.info.coordinates[2].unit, "metre");
  EXPECT_EQ(all.info.nodata, 5);
  std::vector<Point3> expected;
  for (const Point3& p : full) {
    if (p[0] >= 2 && p[0] < 9 && p[1] >= 1 && p[1] < 7 && p[2] != 5) {
      expected.push_back({p[0] + 9, p[1] + 2, p[2]});
    }
  }
  EXPECT_EQ(sorted_cells(all), expected);
  EXPECT_EQ(world_point(all.info, {0, 0, 0}), (Point3{1005, 4995, 100}));
}

TEST_F(Vrt, RejectsElementsThatComputeSamples) {
  std::mt19937_64 random(8);
  put_tiff("a.tif", 0, 0, 20, 10, "", 99, random);
  put_tiff("small.tif", 0, 0, 19, 10, "", 99, random);
  const std::string all = source("");
  EXPECT_EQ(read_file(put_vrt(all)).points.size(), 200U);
  std::string deep;
  for (int i = 0; i < 40; ++i) deep += "<a>";
  const auto message = [&](const std::string& band, const std::string& more = {},
                           const std::string& attributes = {}) {
    const std::string file = put_vrt(band, more, attributes);
    return error_of([&] { read_file(file); });
  };
  for (const auto& [found, words] : std::vector<std::pair<std::string, std::string>>{
           {message(all, "", " subClass='VRTWarpedDataset'"), "VRTWarpedDataset"},
           {message("<KernelFilteredSource/>"), "KernelFilteredSource"},
           {message("<AveragedSource/>"), "AveragedSource"},
           {message(all, "<MaskBand/>"), "MaskBand"},
           {message("<ComplexSource><SourceFilename relativeToVRT='1'>a.tif</SourceFilename>"
                    "<ScaleRatio>2</ScaleRatio></ComplexSource>"),
            "ScaleRatio"},
           {message(source("<LUT>0:1</LUT>")), "LUT"},
           {message(source(rects("xOff='0' yOff='0' xSize='20' ySize='10'",
                                 "xOff='0' yOff='0' xSize='10' ySize='5'"))),
            "resampled"},
           {message(source(rects("xOff='0.5' yOff='0' xSize='2' ySize='2'",
                                 "xOff='0' yOff='0' xSize='2' ySize='2'"))),
            "whole cells"},
           {message(source(rects("xOff='0' yOff='0' xSize='20' ySize='10'",
                                 "xOff='1' yOff='0' xSize='20' ySize='10'"))),
            "outside"},
           {message(source(rects("xOff='-1' yOff='0' xSize='2' ySize='2'",
                                 "xOff='1' yOff='0' xSize='2' ySize='2'"))),
            "outside"},
           {message(source(rects("xOff='0' yOff='0' xSize='1e300' ySize='2'",
                                 "xOff='0' yOff='0' xSize='1e300' ySize='2'"))),
            "outside"},
           {message(source("", "small.tif")), "19 x 10"},
           {message(source("", "none.tif")), "none.tif"},
           {message(source("", "a.vrt")), "a.vrt: is a virtual raster inside another"},  // itself
           {message("<SimpleSource/>"), "names no file"},
           {message(all, "<SRS>" + deep), "nested too deeply"},
           {message(all, "<unclosed>"), "not XML"},
           {message(all, "", " rasterXSize='3'"), "not XML"}}) {
    EXPECT_NE(found.find(words), std::string::npos) << "\"" << found << "\" lacks " << words;
  }
  const auto of_text = [&](const std::string& text) {
    const std::string file = write_text(path("b.vrt"), text);
    return error_of([&] { read_file(file); });
  };
  EXPECT_NE(of_text("<!DOCTYPE a [<!ENTITY x 'y'>]><VRTDataset/>").find("document type"),
            std::string::npos);
  EXPECT_NE(of_text("<VRTDataset rasterXSize='0' rasterYSize='1'/>").find("rasterXSize"),
            std::string::npos);
  EXPECT_NE(of_text("<VRTDataset rasterXSize='1' rasterYSize='99999999999'/>").find("rasterYSize"),
            std::string::npos);
  EXPECT_NE(of_text("<VRTDataset rasterXSize='1' rasterYSize='1'/>").find("no band 1"),
            std::string::npos);
  // The kind of a dataset or band is reported before that of its sources.
  EXPECT_NE(of_text("<VRTDataset subClass='VRTWarpedDataset' rasterXSize='1' rasterYSize='1'>"
                    "<VRTRasterBand><SimpleSource/></VRTRasterBand></VRTDataset>")
                .find("VRTWarpedDataset"),
            std::string::npos);
  // Any damage is an Error.
  const std::string good = read_text(put_vrt(all));
  for (int round = 0; round < 400; ++round) {
    std::string bad = good;
    for (int i = 0; i < 3; ++i) bad[random() % bad.size()] = static_cast<char>(random() % 128);
    of_text(bad);
  }
}

TEST_F(Vrt, HoldsOnlyTheElementsThatAreNeeded) {
  std::mt19937_64 random(9);
  put_tiff("a.tif", 0, 0, 20, 10, "", 99, random);
  const auto repeated = [](const std::string& text, std::size_t times) {
    std::string all;
    for (std::size_t i = 0; i < times; ++i) all += text;
    return all;
  };
  // More bytes than may be held, in elements that do not concern the samples.
  const std::string filler = repeated("<MDI key='a key'>some value</MDI>", 400'000);
  for (const std::string& file : {put_vrt(source(""), "<Metadata>" + filler + "</Metadata>"),
                                  put_vrt("<Metadata>" + filler + "</Metadata>" + source("")),
                                  put_vrt(filler + source(""))}) {
    EXPECT_EQ(read_file(file).points.size(), 200U);
  }
  // Other bands are skipped, whatever their sources.
  const std::string other =
      "<VRTRasterBand>" + repeated("<KernelFilteredSource/>", 400'000) + "</VRTRasterBand>";
  EXPECT_EQ(read_file(put_vrt(source("") + "</VRTRasterBand>" + other +
                              "<VRTRasterBand dataType='Int16'>"))
                .points.size(),
            200U);
  const auto message = [&](const std::string& band) {
    const std::string file = put_vrt(band);
    return error_of([&] { read_file(file); });
  };
  EXPECT_NE(message("<SimpleSource>" + filler + "</SimpleSource>").find("too large for a descr"),
            std::string::npos);
  for (const std::size_t size : {5u << 20, 50u << 20}) {
    const std::string long_text(size, 'x');
    EXPECT_NE(message(source("<a b='" + long_text + "'/>")).find("too long"), std::string::npos);
    EXPECT_EQ(read_file(put_vrt(source("") + repeated("<!-- no part of it -->", size / 20)))
                  .points.size(),
              200U);
  }
}

}  // namespace
}  // namespace terrace::stream
