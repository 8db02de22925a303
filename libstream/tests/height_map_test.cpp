// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <png.h>

#include "format/grid/rasters.hpp"
#include "grid_testing.hpp"

namespace terrace::stream {
namespace {

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

}  // namespace
}  // namespace terrace::stream
