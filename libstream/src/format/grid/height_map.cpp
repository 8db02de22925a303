// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <png.h>

#include "format/grid/plain.hpp"
#include "format/grid/rasters.hpp"
#include "format/raster_points.hpp"
#include "format/registry.hpp"
#include "format/sidecars.hpp"
#include "io/spool.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

/// Samples from colours have 24 bits, so none has this value.
constexpr std::uint32_t kNoColour = std::numeric_limits<std::uint32_t>::max();

/// State of a reading by libpng. That is C and reports errors by longjmp, so exceptions must not
/// pass through it; exceptions of the functions that it calls are kept here.
struct PngReadState {
  const ByteSource* bytes = nullptr;
  std::uint64_t at = 0;
  std::exception_ptr error{};
  char message[128] = "";
};

void on_png_read(png_structp png, png_bytep out, std::size_t count) {
  auto* reading = static_cast<PngReadState*>(png_get_io_ptr(png));
  try {
    if (count <= reading->bytes->size() - reading->at) {
      reading->bytes->read(reading->at, std::as_writable_bytes(std::span(out, count)));
      reading->at += count;
      return;
    }
  } catch (...) {
    reading->error = std::current_exception();
  }
  png_error(png, "the file is truncated");  // does not return
}

[[noreturn]] void on_png_error(png_structp png, png_const_charp message) {
  auto* reading = static_cast<PngReadState*>(png_get_error_ptr(png));
  std::size_t i = 0;
  for (; message[i] != '\0' && i + 1 < sizeof reading->message; ++i)
    reading->message[i] = message[i];
  reading->message[i] = '\0';
  png_longjmp(png, 1);
}

void on_png_warning(png_structp, png_const_charp) {}

/// The header of the image.
struct PngHead {
  std::uint32_t columns = 0, rows = 0;
  int bits = 0, colour_type = 0, passes = 1;
  std::optional<unsigned> transparent_grey{};
};

/// Collects decoded rows in a temporary file.
class RowSpool {
 public:
  RowSpool(const std::string& file, std::uint64_t row_bytes, PngReadState& reading)
      : spool_(std::make_unique<Spool>(file)), row_(row_bytes), reading_(reading) {}

  [[nodiscard]] std::span<unsigned char> row() { return row_; }
  /// Reads a row as the earlier passes of an interlaced image left it. On failure this and put()
  /// return false and keep the exception until libpng has returned.
  bool fetch(std::uint32_t row) noexcept {
    return guarded(
        [&] { spool_->read(row * row_.size(), std::as_writable_bytes(std::span(row_))); });
  }
  bool put(std::uint32_t row) noexcept {
    return guarded([&] { spool_->write(row * row_.size(), std::as_bytes(std::span(row_))); });
  }
  std::unique_ptr<Spool> take() { return std::move(spool_); }

 private:
  template <class Work>
  bool guarded(Work&& work) noexcept {
    try {
      work();
      return true;
    } catch (...) {
      reading_.error = std::current_exception();
      return false;
    }
  }

  std::unique_ptr<Spool> spool_;
  std::vector<unsigned char> row_;
  PngReadState& reading_;
};

/// Reads the header, and also the rows if `spool` is not null: grey unchanged, colours as RGBA with
/// 8 bits each. Returns false if libpng failed. Must not have objects with destructors: longjmp
/// skips them.
bool read_image(PngReadState& reading, PngHead& image, RowSpool* spool) {
  png_structp png =
      png_create_read_struct(PNG_LIBPNG_VER_STRING, &reading, &on_png_error, &on_png_warning);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_read_struct(&png, &info, nullptr);
    return false;
  }
  png_set_read_fn(png, &reading, &on_png_read);
  // The caller checks the sizes. Comments, colour profiles and the like are not kept.
  png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
  png_set_chunk_malloc_max(png, 1u << 20);
  png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
  png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_WARN_DISCARD);
  png_read_info(png, info);
  image.columns = png_get_image_width(png, info);
  image.rows = png_get_image_height(png, info);
  image.bits = png_get_bit_depth(png, info);
  image.colour_type = png_get_color_type(png, info);
  png_color_16p grey = nullptr;
  if (image.colour_type == PNG_COLOR_TYPE_GRAY &&
      png_get_tRNS(png, info, nullptr, nullptr, &grey) == PNG_INFO_tRNS && grey != nullptr) {
    image.transparent_grey = grey->gray;
  }
  if (spool != nullptr) {
    if (image.bits < 8) png_set_packing(png);
    if (image.bits == 16 && std::endian::native == std::endian::little) png_set_swap(png);
    if (image.colour_type != PNG_COLOR_TYPE_GRAY) {
      png_set_palette_to_rgb(png);
      if (png_get_valid(png, info, PNG_INFO_tRNS) != 0) png_set_tRNS_to_alpha(png);
      png_set_add_alpha(png, 0xFF, PNG_FILLER_AFTER);
    }
    image.passes = png_set_interlace_handling(png);
    png_read_update_info(png, info);
    if (png_get_rowbytes(png, info) != spool->row().size()) {
      png_error(png, "rows have another length");
    }
    for (int pass = 0; pass < image.passes; ++pass) {
      for (std::uint32_t row = 0; row < image.rows; ++row) {
        if (pass > 0 && !spool->fetch(row)) png_error(png, "no temporary file");
        png_read_row(png, spool->row().data(), nullptr);
        if (!spool->put(row)) png_error(png, "no temporary file");
      }
    }
    png_read_end(png, nullptr);
  }
  png_destroy_read_struct(&png, &info, nullptr);
  return true;
}

[[noreturn]] void complain(const std::string& file, const PngReadState& reading) {
  if (reading.error) std::rethrow_exception(reading.error);
  throw grid_fault(file, std::string("cannot be read as PNG: ") +
                             (reading.message[0] == '\0' ? "out of memory" : reading.message));
}

std::unique_ptr<Spool> decode_rows(const std::string& file, std::uint64_t row_bytes) {
  const std::unique_ptr<ByteSource> bytes = open_file(file);
  PngReadState reading{.bytes = bytes.get()};
  PngHead image;
  RowSpool spool(file, row_bytes, reading);
  if (!read_image(reading, image, &spool)) complain(file, reading);
  return spool.take();
}

/// Decodes colours to the 24-bit numbers that encode heights.
std::unique_ptr<Spool> decode_colours(const std::string& file, std::uint32_t columns,
                                      std::uint32_t rows) {
  const std::uint64_t row_bytes = std::uint64_t{columns} * sizeof(std::uint32_t);
  std::unique_ptr<Spool> spool = decode_rows(file, row_bytes);
  std::vector<unsigned char> colours(row_bytes);
  std::vector<std::uint32_t> samples(columns);
  for (std::uint32_t row = 0; row < rows; ++row) {
    spool->read(row * row_bytes, std::as_writable_bytes(std::span(colours)));
    for (std::size_t i = 0; i < columns; ++i) {
      const unsigned char* const rgba = colours.data() + 4 * i;
      const auto number = static_cast<std::uint32_t>(rgba[0] << 16 | rgba[1] << 8 | rgba[2]);
      samples[i] = rgba[3] == 0 ? kNoColour : number;
    }
    spool->write(row * row_bytes, std::as_bytes(std::span(samples)));
  }
  return spool;
}

/// Throws: Error if the image is larger than the file can hold, or a row does not fit into memory.
void check_size(const std::string& file, const PngHead& image, std::uint64_t packed,
                std::uint64_t row_bytes, std::uint64_t memory_bytes) {
  const std::uint64_t bits =
      static_cast<unsigned>(image.bits) * (image.colour_type == PNG_COLOR_TYPE_RGB         ? 3U
                                           : image.colour_type == PNG_COLOR_TYPE_RGB_ALPHA ? 4U
                                                                                           : 1U);
  const std::uint64_t stored = image.columns * bits / 8 + 1;
  if (image.rows > packed * kDeflateGrowth / stored) {
    throw grid_fault(file, fmt::format("claims {} x {} pixels, which do not fit into {}",
                                       image.columns, image.rows, counted(packed, "packed byte")));
  }
  // libpng holds two rows besides ours.
  if (row_bytes > memory_bytes / 4) {
    throw grid_fault(file, fmt::format("its rows need {} MiB, the limit is {} MiB",
                                       (row_bytes >> 18) + 1, memory_bytes >> 20))
        .remedy("allow more memory, or convert it: gdal_translate -co TILED=YES FILE out.tif");
  }
}

bool recognise_png(std::span<const std::byte> head) {
  return head.size() >= 8 && std::memcmp(head.data(), "\x89PNG\r\n\x1a\n", 8) == 0;
}

std::unique_ptr<PointSource> open_png_points(std::span<const std::string> files,
                                             const SourceOptions& options) {
  return open_raster_points(files, options, &open_height_map);
}

}  // namespace

std::unique_ptr<Raster> open_height_map(const std::string& file, const RasterOptions& options) {
  check_band(file, options.band, 1);
  const std::unique_ptr<ByteSource> bytes = open_file(file);
  PngReadState reading{.bytes = bytes.get()};
  PngHead image;
  if (!read_image(reading, image, nullptr)) complain(file, reading);

  const bool grey = image.colour_type == PNG_COLOR_TYPE_GRAY;
  const HeightsOfColour colours = options.heights_of_colour;
  if (!grey && colours == HeightsOfColour::none) {
    throw grid_fault(file, "is a colour picture, not a height map")
        .remedy(message(
            "if its colours encode heights, set {heights_of_colour} to mapbox or terrarium; "
            "otherwise "
            "look for the GeoTIFF"));
  }
  if (colours != HeightsOfColour::none &&
      (grey || image.bits == 16 || image.colour_type == PNG_COLOR_TYPE_GRAY_ALPHA)) {
    throw grid_fault(file, "has no 8-bit colours").remedy(message("leave {heights_of_colour} out"));
  }
  const ScalarType type = !grey              ? ScalarType::u32
                          : image.bits == 16 ? ScalarType::u16
                                             : ScalarType::u8;
  std::string nodata;
  if (!grey) nodata = fmt::format("{}", kNoColour);
  if (image.transparent_grey) nodata = fmt::format("{}", *image.transparent_grey);
  if (options.nodata) nodata = *options.nodata;
  PlainGrid grid = plain_grid("png", file, image.columns, image.rows, type, nodata);
  check_size(file, image, bytes->size(), grid.row_bytes, options.memory_bytes);
  constexpr std::uint64_t kOfInflate = 512u << 10;
  grid.info.held_bytes = kOfInflate + 3 * grid.row_bytes;
  grid.info.world = kPlainWorld;
  grid.info.comments.push_back(kNoGeoreferencing);
  place_by_world_file(file, grid.info);
  if (grey) {
    return open_packed_grid(std::move(grid),
                            [file, row = grid.row_bytes] { return decode_rows(file, row); });
  }
  grid.info.sample.unit = grid.info.crs.vertical_unit = "metre";
  if (colours == HeightsOfColour::mapbox) {
    grid.info.sample.scale = 0.1;
    grid.info.sample.offset = -10000;
  } else {
    grid.info.sample.scale = 1.0 / 256;
    grid.info.sample.offset = -32768;
  }
  return open_packed_grid(std::move(grid), [file, columns = image.columns, rows = image.rows] {
    return decode_colours(file, columns, rows);
  });
}

const Format& png_format() {
  // `cell` and `crs` can replace the sidecars.
  static const Format format{.name = "png",
                             .endings = {".png"},
                             .self_contained = true,
                             .recognise = &recognise_png,
                             .open = &open_png_points,
                             .raster = true,
                             .height_colours = true};
  return format;
}

}  // namespace terrace::stream
