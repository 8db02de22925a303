// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/png.hpp"

#include <bit>
#include <cassert>
#include <csetjmp>
#include <exception>
#include <limits>
#include <string>

#include <png.h>

#include "terrace/stream/error.hpp"
#include "terrace/stream/sink.hpp"

namespace terrace::stream {
namespace {

/// An image as libpng needs it. swap: the samples have two bytes in this machine's order, which is
/// not PNG's.
struct Image {
  const unsigned char* pixels;
  std::size_t width, height, row_bytes;
  int bit_depth, color_type;
  bool swap;
};

/// libpng is C and reports errors by longjmp, so exceptions must not pass through it. The exception
/// of a failed write is kept here and rethrown after libpng has returned.
struct Output {
  Sink* file;
  std::exception_ptr error;
  char message[128];
};

void on_write(png_structp png, png_bytep bytes, std::size_t count) {
  auto* output = static_cast<Output*>(png_get_io_ptr(png));
  try {
    output->file->write(std::as_bytes(std::span(bytes, count)));
    return;
  } catch (...) {
    output->error = std::current_exception();
  }
  png_error(png, "write failed");  // does not return
}

void on_flush(png_structp) {}

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  auto* output = static_cast<Output*>(png_get_error_ptr(png));
  std::size_t i = 0;
  for (; message[i] != '\0' && i + 1 < sizeof output->message; ++i) output->message[i] = message[i];
  output->message[i] = '\0';
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

/// Returns false if libpng failed. Must not have objects with destructors: longjmp skips them.
bool write_image(const Image& image, Output& output) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &output, &on_error, &on_warning);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, &output, &on_write, &on_flush);
  png_set_IHDR(png, info, static_cast<png_uint_32>(image.width),
               static_cast<png_uint_32>(image.height), image.bit_depth, image.color_type,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  // Names the writer: only files that we wrote may be replaced.
  static char key[] = "Software", value[] = "terrace";
  png_text mark{};
  mark.compression = PNG_TEXT_COMPRESSION_NONE;
  mark.key = key;
  mark.text = value;
  png_set_text(png, info, &mark, 1);
  png_write_info(png, info);
  if (image.swap) png_set_swap(png);
  for (std::size_t row = 0; row < image.height; ++row) {
    png_write_row(png, image.pixels + row * image.row_bytes);
  }
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return true;
}

void write_file(const std::filesystem::path& path, const Image& image, const Naming& replace,
                const std::stop_token& stop) {
  constexpr std::size_t kMax = std::numeric_limits<std::int32_t>::max();
  if (image.width == 0 || image.height == 0)
    throw Error(path.string(), "a PNG image cannot be empty");
  if (image.width > kMax || image.height > kMax)
    throw Error(path.string(), "a PNG side has at most 2147483647 pixels");
  Sink file(path.string(), replace, stop);
  Output output{.file = &file, .error = nullptr, .message = ""};
  if (!write_image(image, output)) {
    if (output.error) std::rethrow_exception(output.error);
    throw Error(path.string(), std::string("cannot write PNG: ") +
                                   (output.message[0] == '\0' ? "out of memory" : output.message));
  }
  file.commit();
}

}  // namespace

void write_png(const std::filesystem::path& path, std::size_t width, std::size_t height,
               int channels, std::span<const std::uint8_t> pixels, const Naming& replace,
               const std::stop_token& stop) {
  assert(channels >= 1 && channels <= 4);
  assert(pixels.size() == width * height * static_cast<std::size_t>(channels));
  constexpr int kColorTypes[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                 PNG_COLOR_TYPE_RGB_ALPHA};
  write_file(path,
             {.pixels = pixels.data(),
              .width = width,
              .height = height,
              .row_bytes = width * static_cast<std::size_t>(channels),
              .bit_depth = 8,
              .color_type = kColorTypes[channels - 1],
              .swap = false},
             replace, stop);
}

void write_png_grey16(const std::filesystem::path& path, std::size_t width, std::size_t height,
                      std::span<const std::uint16_t> samples, const Naming& replace,
                      const std::stop_token& stop) {
  assert(samples.size() == width * height);
  write_file(path,
             {.pixels = reinterpret_cast<const unsigned char*>(samples.data()),
              .width = width,
              .height = height,
              .row_bytes = width * sizeof(std::uint16_t),
              .bit_depth = 16,
              .color_type = PNG_COLOR_TYPE_GRAY,
              .swap = std::endian::native == std::endian::little},
             replace, stop);
}

}  // namespace terrace::stream
