// SPDX-License-Identifier: Apache-2.0 Invalid files: each gives one Error, or exactly what a
// correct reader would read, and never a crash, a hang, a huge allocation or output on standard
// error.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "raster_testing.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"
#include "tiff_writing.hpp"

namespace terrace::stream {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
constexpr bool kSanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
constexpr bool kSanitized = false;
#endif

std::uint64_t points_in(const std::string& path) {
  const auto source = points_of(open_geotiff(path));
  PointBlock block;
  std::uint64_t points = 0;
  while (source->next(block)) points += block.size();
  return points;
}

/// Writes a new file each time: truncating and rewriting one makes ext4 flush it.
void write_new(const std::string& path, const std::string& bytes) {
  std::filesystem::remove(path);
  std::ofstream(path, std::ios::binary) << bytes;
}

/// The files with valid contents in GDAL's collection of malformed ones; all others are refused.
const std::map<std::string, std::uint64_t> kSound{
    {"byte_bigtiff_invalid_slong8_for_stripoffsets.tif", 400},
    {"huge-implied-number-strips.tif", 400},
    {"minimum_tiff_tags_with_warning.tif", 1},
    {"tag_without_null_byte.tif", 1},
};

/// Opens and reads the file in a separate process with little memory and time, with standard error
/// captured in `log`. Exit code: 0 as expected, 1 not, 2 another exception.
int read_confined(const std::string& path, const std::string& log) {
  const pid_t child = fork();
  if (child == 0) {
    if (!kSanitized) {
      const rlimit memory{400u << 20, 400u << 20};
      setrlimit(RLIMIT_AS, &memory);
    }
    alarm(20);
    if (std::freopen(log.c_str(), "w", stderr) == nullptr) _exit(3);
    const auto sound = kSound.find(std::filesystem::path(path).filename().string());
    int code = 1;
    try {
      const std::uint64_t points = points_in(path);
      code = sound != kSound.end() && points == sound->second ? 0 : 1;
    } catch (const Error& error) {
      const std::string what = error.what();
      const bool good =
          what.starts_with(path) && what.find('\n') == what.npos && !error.parts().remedy.empty();
      code = good && sound == kSound.end() ? 0 : 1;
    } catch (...) {
      code = 2;
    }
    std::fflush(stderr);
    _exit(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

TEST(GeoTiffHostile, RejectsOrReadsEachFileOfTheZoo) {
  const auto folder = real_data();
  if (!folder) GTEST_SKIP() << "needs TERRACE_DATA";
  const TempFolder temp;
  const std::string log = (temp.path() / "stderr").string();
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(*folder / "dem/gdal/hostile")) {
    SCOPED_TRACE(entry.path().string());
    EXPECT_EQ(read_confined(entry.path().string(), log), 0);
    EXPECT_EQ(std::filesystem::file_size(log), 0u);
    ++files;
  }
  EXPECT_GT(files, 25u);
}

/// Checks that a file truncated at any byte gives an Error, or all samples in their places.
void cut_everywhere(const TiffSpec& spec, const std::vector<std::byte>& samples) {
  const TempFolder folder;
  const std::string path = (folder.path() / "whole.tif").string();
  write_tiff(path, spec, samples);
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const WholeRaster whole = read_whole(*open_geotiff(path));
  const std::string cut = (folder.path() / "cut.tif").string();
  std::size_t refused = 0;
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    SCOPED_TRACE(std::to_string(n) + " of " + std::to_string(bytes.size()) + " bytes");
    write_new(cut, bytes.substr(0, n));
    try {
      const WholeRaster part = read_whole(*open_geotiff(cut));
      ASSERT_EQ(part.info.columns, whole.info.columns);
      ASSERT_EQ(part.info.rows, whole.info.rows);
      ASSERT_EQ(part.info.world, whole.info.world);
      ASSERT_EQ(part.info.crs, whole.info.crs);
      ASSERT_EQ(part.info.nodata, whole.info.nodata);
      ASSERT_EQ(part.samples, whole.samples);
      ASSERT_EQ(part.valid, whole.valid);
    } catch (const Error& error) {
      ++refused;
      ASSERT_EQ(error.parts().file, cut);
    }
  }
  EXPECT_GT(refused, bytes.size() * 9 / 10);
}

TiffSpec cuttable() {
  TiffSpec spec;
  spec.columns = 20;
  spec.rows = 17;
  spec.more = [](TIFF* tiff) {
    placed_at(1000, 2000, 30)(tiff);
    const std::vector<std::uint16_t> keys{1,    1, 0, 3, 1024, 0, 1, 1,
                                          1025, 0, 1, 1, 3072, 0, 1, 32632};
    TIFFSetField(tiff, 34735, static_cast<int>(keys.size()), keys.data());
    TIFFSetField(tiff, 42113, "7");
    TIFFSetField(tiff, 42112, "<GDALMetadata>nothing of interest</GDALMetadata>");
  };
  return spec;
}

std::vector<std::byte> cuttable_samples() {
  std::vector<std::int16_t> values(20 * 17);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::int16_t>(i * i % 97);
  return as_samples(values);
}

TEST(GeoTiffHostile, RejectsStripsTruncatedAtAnyByte) {
  TiffSpec spec = cuttable();
  spec.rows_per_strip = 5;
  cut_everywhere(spec, cuttable_samples());
}

TEST(GeoTiffHostile, RejectsBigTiffTilesTruncatedAtAnyByte) {
  TiffSpec spec = cuttable();
  spec.mode = "w8";
  spec.tile_columns = spec.tile_rows = 16;
  spec.compression = COMPRESSION_ADOBE_DEFLATE;
  spec.predictor = 2;
  cut_everywhere(spec, cuttable_samples());
}

TEST(GeoTiffHostile, AnyChangedByteGivesAnErrorOrARaster) {
  const TempFolder folder;
  const std::string path = (folder.path() / "x.tif").string();
  for (const int codec : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE}) {
    TiffSpec spec = cuttable();
    spec.compression = static_cast<std::uint16_t>(codec);
    spec.rows_per_strip = 6;
    write_tiff(path, spec, cuttable_samples());
    std::ifstream file(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    std::size_t errors = 0;
    for (std::size_t n = 0; n < bytes.size(); ++n) {
      for (const int value : {0, 1, 0x7f, 0xff}) {
        std::string changed = bytes;
        changed[n] = static_cast<char>(value);
        write_new(path, changed);
        try {
          const auto source = points_of(open_geotiff(path));
          if (*source->info().points > 1000000) continue;  // sparse or deflated: valid but long
          PointBlock block;
          while (source->next(block)) {
            for (const Point3& p : block.positions) {
              ASSERT_LT(p[0], static_cast<double>(source->info().columns));
              ASSERT_LT(p[1], static_cast<double>(source->info().rows));
            }
          }
        } catch (const Error&) {
          ++errors;
        }
      }
    }
    EXPECT_GT(errors, 0u);
  }
}

TEST(GeoTiffHostile, RejectsMissingEmptyAndSpecialFiles) {
  const TempFolder folder;
  EXPECT_THROW(open_geotiff((folder.path() / "none.tif").string()), Error);
  EXPECT_THROW(open_geotiff(folder.path().string()), Error);
  EXPECT_THROW(open_geotiff("/dev/null"), Error);
  const std::string empty = (folder.path() / "empty.tif").string();
  std::ofstream{empty};
  EXPECT_THROW(open_geotiff(empty), Error);
}

TEST(GeoTiffHostile, RejectsMissingBands) {
  const TempFolder folder;
  const std::string path = (folder.path() / "x.tif").string();
  write_tiff(path, {}, std::vector<std::byte>(2));
  for (const int band : {-1, 0, 2, 1 << 30}) {
    EXPECT_THROW(open_geotiff(path, {.band = band}), Error) << band;
  }
  EXPECT_NO_THROW(open_geotiff(path, {.band = 1}));
}

TEST(GeoTiffHostile, NodataAloneIsAnEmptyStream) {
  const TempFolder folder;
  const std::string path = (folder.path() / "x.tif").string();
  TiffSpec spec;
  spec.columns = spec.rows = 50;
  spec.more = [](TIFF* tiff) { TIFFSetField(tiff, 42113, "0"); };
  write_tiff(path, spec, std::vector<std::byte>(5000));
  const auto source = points_of(open_geotiff(path));
  PointBlock block;
  EXPECT_FALSE(source->next(block));
  EXPECT_EQ(source->progress().nodata, 2500u);
  EXPECT_EQ(source->progress().points, 0u);
  EXPECT_EQ(source->progress().fraction, 1.0);
}

}  // namespace
}  // namespace terrace::stream
