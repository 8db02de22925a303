// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/png.hpp"

#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <png.h>

#include "point_files.hpp"

namespace terrace::stream {
namespace {

/// libpng's simplified reader as the oracle; `format` is one of its PNG_FORMAT_ values.
std::vector<std::uint8_t> decode(const std::string& path, std::uint32_t format, std::size_t& width,
                                 std::size_t& height) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_file(&image, path.c_str()), 0) << image.message;
  image.format = format;
  width = image.width;
  height = image.height;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(image));
  EXPECT_NE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr), 0) << image.message;
  return pixels;
}

TEST(Png, RoundTripsEveryPixel) {
  const TempFolder folder;
  std::mt19937_64 random(1);
  const std::uint32_t formats[] = {PNG_FORMAT_GRAY, PNG_FORMAT_GA, PNG_FORMAT_RGB, PNG_FORMAT_RGBA};
  for (int channels = 1; channels <= 4; ++channels) {
    for (const auto& [w, h] : {std::pair{1, 1}, std::pair{37, 5}, std::pair{3, 200}}) {
      SCOPED_TRACE(channels);
      const auto width = static_cast<std::size_t>(w), height = static_cast<std::size_t>(h);
      std::vector<std::uint8_t> pixels(width * height * static_cast<std::size_t>(channels));
      for (auto& value : pixels) value = static_cast<std::uint8_t>(random());
      const std::string path = (folder.path() / "i.png").string();
      write_png(path, width, height, channels, pixels, /*replace=*/true);
      std::size_t width_back = 0, height_back = 0;
      EXPECT_EQ(decode(path, formats[channels - 1], width_back, height_back), pixels);
      EXPECT_EQ(width_back, width);
      EXPECT_EQ(height_back, height);
    }
  }
}

TEST(Png, SixteenBitsAreBigEndianInTheFile) {
  const TempFolder folder;
  const std::string path = (folder.path() / "g.png").string();
  const std::vector<std::uint16_t> samples{0, 1, 255, 256, 0x1234, 65535};
  write_png_grey16(path, 3, 2, samples);
  // libpng's low-level interface gives the bytes as they are in the file.
  FILE* file = std::fopen(path.c_str(), "rb");
  ASSERT_NE(file, nullptr);
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_read_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
  EXPECT_EQ(png_get_bit_depth(png, info), 16);
  EXPECT_EQ(png_get_color_type(png, info), PNG_COLOR_TYPE_GRAY);
  png_bytepp rows = png_get_rows(png, info);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const png_bytep at = rows[i / 3] + 2 * (i % 3);
    EXPECT_EQ(at[0] * 256 + at[1], samples[i]);
  }
  png_destroy_read_struct(&png, &info, nullptr);
  std::fclose(file);
}

TEST(Png, ErrorsLeaveNoFiles) {
  const TempFolder folder;
  const auto path = folder.path() / "i.png";
  EXPECT_NE(error_of([&] { write_png(path, 0, 5, 3, {}); }), "");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  const std::vector<std::uint8_t> pixel{1, 2, 3};
  write_png(path, 1, 1, 3, pixel);
  EXPECT_NE(error_of([&] { write_png(path, 1, 1, 3, pixel); }), "") << "it exists";
  write_png(path, 1, 1, 3, pixel, true);
  EXPECT_NE(error_of([&] { write_png(folder.path() / "no" / "i.png", 1, 1, 3, pixel); }), "");
}

}  // namespace
}  // namespace terrace::stream
