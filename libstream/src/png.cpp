// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/png.hpp"

#include <array>
#include <cassert>
#include <cerrno>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <png.h>

#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
struct PictureView {
  std::uint32_t width = 0, height = 0;
  unsigned channels = 3;
  std::span<const std::uint8_t> pixels;
};
namespace {

/// Where libpng's bytes go. libpng is C: an exception must not pass through it, so it is kept here
/// until the call has come back.
struct Sink {
  std::optional<AtomicFile> file;  ///< none: standard output
  std::exception_ptr failure;

  void write(std::span<const std::byte> bytes) {
    if (file) {
      file->write(bytes);
    } else if (std::fwrite(bytes.data(), 1, bytes.size(), stdout) != bytes.size()) {
      throw system_error("standard output", "cannot write", errno);
    }
  }
};

void write_bytes(png_structp png, png_bytep bytes, std::size_t size) {
  Sink& sink = *static_cast<Sink*>(png_get_io_ptr(png));
  try {
    sink.write({reinterpret_cast<const std::byte*>(bytes), size});
  } catch (...) {
    sink.failure = std::current_exception();
  }
  if (sink.failure) png_error(png, "write failed");  // jumps; no object may live here
}

void flush_nothing(png_structp /*png*/) {}

/// Everything between libpng's setjmp and its jumps: no object with a destructor. False on failure.
bool encode(png_structp png, png_infop info, const PictureView& picture) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  const int colour = picture.channels == 1   ? PNG_COLOR_TYPE_GRAY
                     : picture.channels == 3 ? PNG_COLOR_TYPE_RGB
                                             : PNG_COLOR_TYPE_RGBA;
  png_set_IHDR(png, info, picture.width, picture.height, 8, colour, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  // Pictures are looked at once or twice: half the size limit of time for a tenth of the size.
  png_set_compression_level(png, 4);
  char key[] = "Software";
  char value[] = "terrace";
  png_text text{};
  text.compression = PNG_TEXT_COMPRESSION_NONE;
  text.key = key;
  text.text = value;
  png_set_text(png, info, &text, 1);
  png_write_info(png, info);
  const std::size_t row_bytes = std::size_t{picture.width} * picture.channels;
  for (std::uint32_t row = 0; row < picture.height; ++row) {
    png_write_row(png, picture.pixels.data() + row * row_bytes);
  }
  png_write_end(png, info);
  return true;
}

}  // namespace

void write_png(const std::filesystem::path& path, std::size_t width, std::size_t height,
               int channels, std::span<const std::uint8_t> pixels, bool replace) {
  const PictureView picture{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height),
                            static_cast<unsigned>(channels), pixels};
  assert(picture.width > 0 && picture.height > 0);
  assert(picture.channels == 1 || picture.channels == 3 || picture.channels == 4);
  assert(picture.pixels.size() == std::size_t{picture.width} * picture.height * picture.channels);

  Sink sink;
  if (path != "-") sink.file.emplace(path, replace);
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  bool done = false;
  if (info != nullptr) {
    png_set_write_fn(png, &sink, write_bytes, flush_nothing);
    // Without an error function libpng would print to standard error.
    png_set_error_fn(
        png, nullptr, [](png_structp p, png_const_charp) { png_longjmp(p, 1); },
        [](png_structp, png_const_charp) {});
    done = encode(png, info, picture);
  }
  png_destroy_write_struct(&png, &info);
  if (sink.failure) std::rethrow_exception(sink.failure);
  if (!done) {
    throw Error({.file = path.string(),
                 .where = {},
                 .cause = "cannot be encoded as PNG",
                 .remedy = "choose a smaller picture"});
  }
  if (sink.file) {
    sink.file->commit();
  } else if (std::fflush(stdout) != 0) {
    throw system_error("standard output", "cannot write", errno);
  }
}

}  // namespace terrace::stream
