// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "format/grid/binary.hpp"
#include "grid_testing.hpp"

namespace terrace::stream {
namespace {

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

}  // namespace
}  // namespace terrace::stream
