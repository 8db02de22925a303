// SPDX-License-Identifier: Apache-2.0
// Files written by libtiff, in all of its encodings, must be read back bit for bit.
#include <bit>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "format/geotiff/layout.hpp"
#include "gdal_tools.hpp"
#include "raster_testing.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"
#include "tiff_writing.hpp"

namespace terrace::stream {
namespace {

constexpr std::array<ScalarType, 10> kTypes{
    ScalarType::i8,  ScalarType::u8,  ScalarType::i16, ScalarType::u16, ScalarType::i32,
    ScalarType::u32, ScalarType::i64, ScalarType::u64, ScalarType::f32, ScalarType::f64};

bool is_float(ScalarType type) { return type == ScalarType::f32 || type == ScalarType::f64; }

/// Samples with long runs and noise: any bits for integers, finite floats.
std::vector<std::byte> random_samples(std::mt19937_64& random, ScalarType type, std::size_t count) {
  std::vector<std::byte> bytes(count * size_of(type));
  std::uint64_t value = random();
  for (std::size_t i = 0; i < count; ++i) {
    if (random() % 3 != 0) value = random() >> (random() % 64);
    if (type == ScalarType::f32) {
      const auto f = static_cast<float>(static_cast<std::int64_t>(value)) * 0x1p-20f;
      std::memcpy(bytes.data() + i * 4, &f, 4);
    } else if (type == ScalarType::f64) {
      const double f = static_cast<double>(static_cast<std::int64_t>(value)) * 0x1p-20;
      std::memcpy(bytes.data() + i * 8, &f, 8);
    } else {
      std::memcpy(bytes.data() + i * size_of(type), &value, size_of(type));
    }
  }
  return bytes;
}

std::vector<std::byte> band_of(const std::vector<std::byte>& samples, const TiffSpec& spec,
                               std::uint32_t band) {
  const std::size_t size = size_of(spec.type), cells = std::size_t{spec.columns} * spec.rows;
  std::vector<std::byte> bytes(cells * size);
  for (std::size_t i = 0; i < cells; ++i) {
    std::memcpy(bytes.data() + i * size, samples.data() + (i * spec.bands + band) * size, size);
  }
  return bytes;
}

/// Checks the file read as a whole, in random windows with little memory, and as points.
void expect_samples(const std::string& path, const TiffSpec& spec,
                    const std::vector<std::byte>& expected, int band, std::mt19937_64& random) {
  const std::size_t size = size_of(spec.type);
  const auto raster = open_geotiff(path, {.band = band});
  const WholeRaster whole = read_whole(*raster);
  ASSERT_EQ(whole.info.columns, spec.columns);
  ASSERT_EQ(whole.info.rows, spec.rows);
  ASSERT_EQ(whole.info.sample.type, spec.type);
  ASSERT_EQ(whole.samples, expected);
  ASSERT_EQ(std::count(whole.valid.begin(), whole.valid.end(), 1),
            static_cast<std::ptrdiff_t>(whole.cells()));

  const auto frugal = open_geotiff(path, {.band = band, .cache_bytes = random() % 40000});
  for (int i = 0; i < 4; ++i) {
    CellWindow window;
    window.column = random() % spec.columns;
    window.row = random() % spec.rows;
    window.columns = 1 + random() % (spec.columns - window.column);
    window.rows = 1 + random() % (spec.rows - window.row);
    const std::size_t stride = window.columns + random() % 3;
    std::vector<std::byte> samples(stride * window.rows * size);
    std::vector<std::uint8_t> valid(stride * window.rows);
    ASSERT_TRUE(frugal->read_over(window, {samples.data(), valid.data(), stride}));
    for (std::size_t r = 0; r < window.rows; ++r) {
      const std::size_t cell = (window.row + r) * spec.columns + window.column;
      ASSERT_EQ(std::memcmp(samples.data() + r * stride * size, expected.data() + cell * size,
                            window.columns * size),
                0);
    }
  }

  SourceOptions options;
  options.band = band;
  options.block_points = 1 + random() % 500;
  options.memory_bytes = 100000 + random() % 100000;
  const auto source = points_of(open_geotiff(path, {.band = band}), options);
  std::vector<std::byte> delivered(expected.size());
  std::vector<int> times(std::size_t{spec.columns} * spec.rows);
  PointBlock block;
  while (source->next(block)) {
    ASSERT_LE(block.size(), options.block_points);
    const bool exact = !source->info().attributes.empty();
    for (std::size_t i = 0; i < block.size(); ++i) {
      const Point3& p = block.positions[i];
      const auto cell =
          static_cast<std::size_t>(p[1]) * spec.columns + static_cast<std::size_t>(p[0]);
      ++times.at(cell);
      if (exact) {
        std::memcpy(delivered.data() + cell * size, block.payload.data() + i * size, size);
      } else {
        ASSERT_EQ(p[2], whole.value(cell));
      }
    }
    ASSERT_EQ(block.payload.size(), exact ? block.size() * size : 0);
  }
  ASSERT_EQ(std::count(times.begin(), times.end(), 1), static_cast<std::ptrdiff_t>(times.size()));
  ASSERT_EQ(source->progress().points, times.size());
  ASSERT_EQ(source->progress().fraction, 1.0);
  if (!source->info().attributes.empty()) {
    ASSERT_EQ(delivered, expected);
  }
}

void round_trip(TiffSpec spec, std::uint64_t seed) {
  SCOPED_TRACE("seed " + std::to_string(seed) + " type " + std::string(name_of(spec.type)) +
               " codec " + std::to_string(spec.compression) + " predictor " +
               std::to_string(spec.predictor) + " mode " + spec.mode + " tile " +
               std::to_string(spec.tile_columns) + " bands " + std::to_string(spec.bands));
  std::mt19937_64 random(seed);
  const TempFolder folder;
  const std::string path = (folder.path() / "x.tif").string();
  const auto samples =
      random_samples(random, spec.type, std::size_t{spec.columns} * spec.rows * spec.bands);
  ASSERT_NO_FATAL_FAILURE(write_tiff(path, spec, samples));
  for (std::uint32_t band = 0; band < spec.bands; ++band) {
    ASSERT_NO_FATAL_FAILURE(expect_samples(path, spec, band_of(samples, spec, band),
                                           static_cast<int>(band) + 1, random));
  }
}

TEST(GeoTiffEncodings, ReadsEveryTypeAndCodec) {
  std::uint64_t seed = 1;
  for (const ScalarType type : kTypes) {
    for (const int codec :
         {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_PACKBITS, COMPRESSION_ADOBE_DEFLATE,
          COMPRESSION_DEFLATE, COMPRESSION_LZMA, COMPRESSION_ZSTD, COMPRESSION_LERC}) {
      if (TIFFIsCODECConfigured(static_cast<std::uint16_t>(codec)) == 0) continue;
      // LERC does not support 64-bit integers.
      if (codec == COMPRESSION_LERC && (type == ScalarType::i64 || type == ScalarType::u64)) {
        continue;
      }
      const bool predicts = codec == COMPRESSION_LZW || codec == COMPRESSION_ADOBE_DEFLATE ||
                            codec == COMPRESSION_DEFLATE || codec == COMPRESSION_ZSTD;
      for (const int predictor : {1, 2, 3}) {
        if (predictor != 1 && !predicts) continue;
        if (predictor == 3 && !is_float(type)) continue;
        std::mt19937_64 random(++seed);
        TiffSpec spec;
        spec.type = type;
        spec.compression = static_cast<std::uint16_t>(codec);
        spec.predictor = static_cast<std::uint16_t>(predictor);
        spec.columns = 1 + static_cast<std::uint32_t>(random() % 90);
        spec.rows = 1 + static_cast<std::uint32_t>(random() % 90);
        spec.mode = random() % 2 == 0 ? "w" : "w8";
        // libtiff's writer (4.5) ignores the byte order with predictor 3; its reader does not, as
        // the real files show.
        if (predictor != 3 && random() % 2 == 0) spec.mode += "b";
        if (random() % 2 == 0) {
          spec.tile_columns = 16 * (1 + static_cast<std::uint32_t>(random() % 3));
          spec.tile_rows = 16 * (1 + static_cast<std::uint32_t>(random() % 3));
        } else {
          spec.rows_per_strip = static_cast<std::uint32_t>(random() % (spec.rows + 1));
        }
        if (codec != COMPRESSION_LERC) {
          spec.bands = 1 + static_cast<std::uint32_t>(random() % 3);
          spec.separate = random() % 2 == 0;
        }
        round_trip(spec, seed);
        if (::testing::Test::HasFatalFailure()) return;
      }
    }
  }
}

TEST(GeoTiffEncodings, ReadsACompressedStripLargerThanMemoryByRows) {
  const TempFolder folder;
  const std::string path = (folder.path() / "x.tif").string();
  TiffSpec spec;
  spec.columns = 700;
  spec.rows = 900;
  spec.compression = COMPRESSION_ADOBE_DEFLATE;
  std::vector<std::int16_t> values(std::size_t{spec.columns} * spec.rows);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::int16_t>(i / 64);
  write_tiff(path, spec, as_samples(values));
  SourceOptions options;
  options.memory_bytes = 100000;  // a tenth of the strip
  const auto source = points_of(open_geotiff(path, {.memory_bytes = 100000}), options);
  PointBlock block;
  std::size_t points = 0;
  while (source->next(block)) {
    for (const Point3& p : block.positions) {
      ASSERT_EQ(p[2],
                values[static_cast<std::size_t>(p[1]) * 700 + static_cast<std::size_t>(p[0])]);
      ++points;
    }
  }
  EXPECT_EQ(points, values.size());
}

/// Large strips are read row by row, in windows in any order, and the memory reported for the file
/// does not include the decoded strip.
TEST(GeoTiffEncodings, DoesNotHoldALargeStripDecoded) {
  const TempFolder folder;
  const std::string path = (folder.path() / "x.tif").string();
  for (const int codec : {COMPRESSION_ADOBE_DEFLATE, COMPRESSION_LZW, COMPRESSION_PACKBITS}) {
    SCOPED_TRACE(codec);
    TiffSpec spec;
    spec.columns = 2000;
    spec.rows = 1500;
    spec.compression = static_cast<std::uint16_t>(codec);
    std::vector<std::int16_t> values(std::size_t{spec.columns} * spec.rows);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::int16_t>(i / 700);
    write_tiff(path, spec, as_samples(values));
    const auto raster = open_geotiff(path);
    EXPECT_LT(raster->info().held_bytes,
              std::filesystem::file_size(path) + (std::uint64_t{1} << 20));
    std::vector<std::int16_t> window(100 * 20);
    std::vector<std::uint8_t> valid(window.size());
    for (const std::uint64_t row : {0u, 700u, 710u, 1480u, 3u}) {
      raster->read_over({.column = 1900, .row = row, .columns = 100, .rows = 20},
                        {.samples = reinterpret_cast<std::byte*>(window.data()),
                         .valid = valid.data(),
                         .stride = 100});
      for (std::size_t i = 0; i < window.size(); ++i) {
        ASSERT_EQ(window[i], values[(row + i / 100) * 2000 + 1900 + i % 100]) << row << ' ' << i;
      }
    }
  }
}

TEST(GeoTiffEncodings, RejectsATileLargerThanMemoryAndStatesItsSize) {
  const TempFolder folder;
  const std::string path = (folder.path() / "x.tif").string();
  TiffSpec spec;
  spec.columns = spec.rows = 16;
  spec.tile_columns = spec.tile_rows = 2048;
  spec.compression = COMPRESSION_ADOBE_DEFLATE;
  write_tiff(path, spec, std::vector<std::byte>(512));
  try {
    open_geotiff(path, {.memory_bytes = 1u << 20});
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("MiB"), std::string::npos) << error.what();
  }
  EXPECT_NO_THROW(open_geotiff(path));
}

/// Checks a mask: cells for which `hidden` is 1 have no data.
void expect_hidden(const std::string& path, const std::vector<std::uint8_t>& hidden) {
  const WholeRaster whole = read_whole(*open_geotiff(path));
  ASSERT_EQ(whole.cells(), hidden.size());
  for (std::size_t i = 0; i < hidden.size(); ++i) {
    EXPECT_EQ(whole.valid[i], 1 - hidden[i]) << i;
    EXPECT_EQ(whole.value(i), hidden[i] != 0 ? 0 : static_cast<double>(i)) << i;
  }
}

TEST(GeoTiffEncodings, MaskedCellsHaveNoData) {
  const TempFolder folder;
  const std::string path = (folder.path() / "x.tif").string();
  TiffSpec spec;
  spec.columns = 40;
  spec.rows = 30;
  spec.type = ScalarType::u16;
  spec.tile_columns = spec.tile_rows = 16;
  std::vector<std::uint16_t> heights(1200);
  std::vector<std::uint8_t> hidden(1200), mask(1200);
  for (std::size_t i = 0; i < heights.size(); ++i) {
    heights[i] = static_cast<std::uint16_t>(i);
    hidden[i] = i % 7 < 2 || i > 1100 ? 1 : 0;
    mask[i] = hidden[i] != 0 ? 0 : 255;
  }

  TiffSpec mask_spec = spec;
  mask_spec.type = ScalarType::u8;
  mask_spec.tile_columns = mask_spec.tile_rows = 32;
  write_tiff(path, spec, as_samples(heights));
  write_tiff(path + ".msk", mask_spec, as_samples(mask));
  expect_hidden(path, hidden);
  std::filesystem::remove(path + ".msk");
  expect_hidden(path, std::vector<std::uint8_t>(1200));

  mask_spec.mode = "a";
  mask_spec.compression = COMPRESSION_ADOBE_DEFLATE;
  mask_spec.more = [](TIFF* tiff) { TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, FILETYPE_MASK); };
  write_tiff(path, mask_spec, as_samples(mask));
  expect_hidden(path, hidden);
}

TEST(GeoTiffEncodings, RejectsAMaskOfAnotherSize) {
  const TempFolder folder;
  const std::string path = (folder.path() / "x.tif").string();
  TiffSpec spec;
  spec.columns = spec.rows = 4;
  write_tiff(path, spec, std::vector<std::byte>(32));
  spec.rows = 3;
  write_tiff(path + ".msk", spec, std::vector<std::byte>(24));
  EXPECT_THROW(open_geotiff(path), Error);
}

/// Packs unsigned numbers of `bits` bits, highest bit first; each row starts at a byte.
std::vector<std::uint8_t> packed(const std::vector<std::uint32_t>& values, std::size_t columns,
                                 unsigned bits) {
  std::vector<std::uint8_t> out;
  for (std::size_t row = 0; row < values.size() / columns; ++row) {
    std::size_t at = 0;
    out.resize((row + 1) * ((columns * bits + 7) / 8));
    std::uint8_t* const line = out.data() + row * ((columns * bits + 7) / 8);
    for (std::size_t c = 0; c < columns; ++c) {
      for (unsigned b = bits; b-- > 0; ++at) {
        if ((values[row * columns + c] >> b & 1) != 0) {
          line[at / 8] = static_cast<std::uint8_t>(line[at / 8] | (0x80 >> at % 8));
        }
      }
    }
  }
  return out;
}

TEST(GeoTiffEncodings, ReadsIntegersOfOddWidths) {
  const TempFolder folder;
  const std::string path = (folder.path() / "x.tif").string();
  std::mt19937_64 random(7);
  for (unsigned bits = 1; bits < 32; ++bits) {
    if (bits == 8 || bits == 16) continue;
    for (const int format : {SAMPLEFORMAT_UINT, SAMPLEFORMAT_INT}) {
      const char* const mode = bits % 2 == 0 ? "wl" : "wb";
      SCOPED_TRACE(std::to_string(bits) + " bits, format " + std::to_string(format));
      constexpr std::size_t kColumns = 13, kRows = 5;
      std::vector<std::uint32_t> values(kColumns * kRows);
      for (auto& v : values) v = static_cast<std::uint32_t>(random()) & ((1u << bits) - 1);
      std::vector<std::uint8_t> bytes = packed(values, kColumns, bits);
      TIFF* tiff = TIFFOpen(path.c_str(), mode);
      TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(kColumns));
      TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(kRows));
      TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, static_cast<int>(bits));
      TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, format);
      TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
      TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, static_cast<std::uint32_t>(kRows));
      TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
      TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
      ASSERT_GT(TIFFWriteEncodedStrip(tiff, 0, bytes.data(), static_cast<tmsize_t>(bytes.size())),
                0);
      TIFFClose(tiff);
      const WholeRaster whole = read_whole(*open_geotiff(path));
      for (std::size_t i = 0; i < values.size(); ++i) {
        auto expected = static_cast<double>(values[i]);
        if (format == SAMPLEFORMAT_INT && (values[i] >> (bits - 1)) != 0) {
          expected -= static_cast<double>(std::uint64_t{1} << bits);
        }
        ASSERT_EQ(whole.value(i), expected) << i;
      }
    }
  }
}

TEST(GeoTiffEncodings, ReadsOddWidthsThatGdalWrites) {
  if (!has_gdal()) GTEST_SKIP() << "no GDAL here";
  const TempFolder folder;
  const std::string source = (folder.path() / "a.tif").string();
  const std::string path = (folder.path() / "x.tif").string();
  std::mt19937_64 random(9);
  constexpr std::uint32_t kColumns = 21, kRows = 19, kBands = 2;
  for (int round = 0; round < 30 / TERRACE_TEST_SHARE; ++round) {
    // libtiff swaps samples of 24 bits.
    const unsigned bits = round % 3 == 0 ? 24 : 1 + static_cast<unsigned>(random() % 31);
    std::vector<std::uint32_t> values(std::size_t{kColumns} * kRows * kBands);
    for (auto& v : values) v = static_cast<std::uint32_t>(random()) & ((1u << bits) - 1);
    TiffSpec spec;
    spec.columns = kColumns;
    spec.rows = kRows;
    spec.bands = kBands;
    spec.type = ScalarType::u32;
    write_tiff(source, spec, as_samples(values));
    const auto one_of = [&](const char* a, const char* b) { return random() % 2 == 0 ? a : b; };
    const std::string type = bits <= 8 ? "Byte" : bits <= 16 ? "UInt16" : "UInt32";
    const std::string options = "-ot " + type + " -co NBITS=" + std::to_string(bits) +
                                " -co ENDIANNESS=" + one_of("LITTLE", "BIG") +
                                " -co INTERLEAVE=" + one_of("PIXEL", "BAND") +
                                " -co COMPRESS=" + one_of("NONE", "DEFLATE") +
                                one_of("", " -co TILED=YES -co BLOCKXSIZE=16 -co BLOCKYSIZE=16");
    SCOPED_TRACE(options);
    std::filesystem::remove(path);
    ASSERT_EQ(std::system(("gdal_translate -q " + options + " '" + source + "' '" + path +
                           "' >/dev/null 2>&1")
                              .c_str()),
              0);
    for (int band = 1; band <= 2; ++band) {
      const WholeRaster whole = read_whole(*open_geotiff(path, {.band = band}));
      for (std::size_t i = 0; i < whole.cells(); ++i) {
        ASSERT_EQ(whole.value(i), values[kBands * i + static_cast<std::size_t>(band) - 1]) << i;
      }
    }
  }
}

/// Returns the value of a small float by the definition of IEEE 754, in powers of two.
double small_float(std::uint32_t bits, int exponent_bits, int mantissa_bits) {
  const std::uint32_t mantissa = bits & ((1u << mantissa_bits) - 1);
  const int max_exponent = (1 << exponent_bits) - 1;
  const int exponent = static_cast<int>(bits >> mantissa_bits) & max_exponent;
  const double sign = (bits >> (mantissa_bits + exponent_bits)) != 0 ? -1 : 1;
  if (exponent == max_exponent) {
    return mantissa != 0 ? std::nan("") : sign * std::numeric_limits<double>::infinity();
  }
  const int bias = max_exponent / 2;
  if (exponent == 0) return sign * std::ldexp(mantissa, 1 - bias - mantissa_bits);
  return sign * std::ldexp(mantissa + (1u << mantissa_bits), exponent - bias - mantissa_bits);
}

TEST(GeoTiffEncodings, WidensEverySmallFloatExactly) {
  for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
    const double expected = small_float(bits, 5, 10);
    const auto got = static_cast<double>(float_from_16(static_cast<std::uint16_t>(bits)));
    if (std::isnan(expected)) {
      ASSERT_TRUE(std::isnan(got)) << bits;
    } else {
      ASSERT_EQ(std::bit_cast<std::uint64_t>(got), std::bit_cast<std::uint64_t>(expected)) << bits;
    }
  }
  for (std::uint32_t bits = 0; bits < 0x1000000; bits += 7) {
    const double expected = small_float(bits, 7, 16);
    const auto got = static_cast<double>(float_from_24(bits));
    if (std::isnan(expected)) {
      ASSERT_TRUE(std::isnan(got)) << bits;
    } else {
      ASSERT_EQ(std::bit_cast<std::uint64_t>(got), std::bit_cast<std::uint64_t>(expected)) << bits;
    }
  }
}

}  // namespace
}  // namespace terrace::stream
