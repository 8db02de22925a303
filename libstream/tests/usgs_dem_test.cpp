// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "format/grid/rasters.hpp"
#include "grid_testing.hpp"

namespace terrace::stream {
namespace {

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
  EXPECT_NE(with(546 + 3 * 24, "    9.0D+99             ").find("is not from 1 to 999,999"),
            std::string::npos);
  EXPECT_NE(with(816, "0.000000E+00").find("not positive"), std::string::npos);
  EXPECT_NE(with(816, "         nan"), "");
  EXPECT_NE(with(1024 + 12, "     x").find("is not a number of samples"), std::string::npos);
  EXPECT_NE(with(1024 + 12, "999999"), "");
}

}  // namespace
}  // namespace terrace::stream
