// SPDX-License-Identifier: Apache-2.0 Scans by third parties, if TERRACE_DATA names a folder that
// contains them.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "las_files.hpp"
#include "point_files.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {
namespace {

std::uint64_t fnv1a(std::string_view bytes) {
  std::uint64_t hash = 1469598103934665603U;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  return hash;
}

std::filesystem::path data_folder() {
  const char* data = std::getenv("TERRACE_DATA");
  return data == nullptr ? std::filesystem::path() : std::filesystem::path(data) / "lidar";
}

/// Reads a file and writes it again, which must not move anything.
void copy_points(const std::string& source_path, const std::string& target_path,
                 unsigned threads = 1) {
  const auto source = open_source(std::span(&source_path, 1), {.threads = threads});
  const auto writer = open_point_writer(
      target_path, {.attributes = source->info().attributes, .lattice = lattice_of(source->info())},
      {.replace = true});
  PointBlock block;
  while (source->next(block)) {
    to_world(source->info(), block);
    writer->append(block);
  }
  writer->finish();
  EXPECT_EQ(writer->rounding(), 0.0);
}

/// Returns the records of a file that was read and written again.
std::string records_through(const std::filesystem::path& file, const TempFolder& temp,
                            unsigned threads = 1) {
  const std::string path = temp.path() / "copy.las";
  copy_points(file.string(), path, threads);
  return records_of(path);
}

TEST(LasReal, RoundTripsEveryRecord) {
  const std::filesystem::path folder = data_folder();
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no TERRACE_DATA";
  const TempFolder temp;
  std::size_t files_read = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".las") continue;
    SCOPED_TRACE(entry.path().filename());
    EXPECT_EQ(records_through(entry.path(), temp), records_of(entry.path()));
    ++files_read;
  }
  EXPECT_GT(files_read, 30U);
}

struct Survey {
  const char* file;
  std::uint64_t points;
  Point3 min, max;  ///< as published
  int epsg;
};

TEST(LasReal, PointsMatchThePublishedFacts) {
  constexpr Survey kSurveys[] = {
      {"1.2-with-color.las",
       1065,
       {635619.85, 848899.70, 406.59},
       {638982.55, 853535.43, 586.38},
       0},
      {"autzen-dd.las", 1065, {-123.075, 44.050, 123.93}, {-123.063, 44.062, 178.73}, 4326},
      {"autzen_trim_7.las",
       110000,
       {636001.76, 848935.2, 406.26},
       {637179.22, 849497.9, 520.51},
       0},
      {"hexbin-crop.las",
       38367,
       {393775.823, 3689071.943, 3107.863},
       {394069.238, 3689273.095, 3209.321},
       32642},
      {"laspy_vegetation_1_3.las",
       10683,
       {-98451.205, -55975.417, -81460.091},
       {-98447.447, -55969.405, -81455.203},
       0},
      {"no-points.las", 0, {}, {}, 4269},
  };
  const std::filesystem::path folder = data_folder();
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no TERRACE_DATA";
  for (const Survey& survey : kSurveys) {
    SCOPED_TRACE(survey.file);
    AllPoints all = read_file(folder / survey.file);
    EXPECT_EQ(all.points.size(), survey.points);
    EXPECT_EQ(all.info.crs.epsg, survey.epsg);
    Box3 box;
    to_world(all.info, all.points);
    for (const Point3& p : all.points.positions) box.include(p);
    for (std::size_t axis = 0; axis < 3 && survey.points > 0; ++axis) {
      EXPECT_NEAR(box.min[axis], survey.min[axis], 6e-4);
      EXPECT_NEAR(box.max[axis], survey.max[axis], 6e-4);
    }
  }
}

TEST(LasReal, CompressedRecordsMatchLaszip) {
  const std::filesystem::path folder = data_folder();
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no TERRACE_DATA";
  const TempFolder temp;
  std::ifstream table(TERRACE_TEST_DATA "/laz_facts.tsv");
  std::string name;
  std::uint64_t points = 0, hash = 0;
  std::size_t files_read = 0;
  while (table >> name >> std::dec >> points >> std::hex >> hash) {
    SCOPED_TRACE(name);
    ++files_read;
    std::filesystem::path file = folder / name;
    if (name.ends_with(".copc.laz")) {
      // Remove the mark of COPC, so that the file is read in its own order, not by its octree.
      std::string bytes = read_text(file);
      bytes.replace(377, 4, "none");
      file = write_text(temp.path() / "plain.laz", bytes);
    }
    EXPECT_EQ(fnv1a(records_through(file, temp, 3)), hash);
    // Other ways of reading are slow, so they are tested with the small files only.
    if (points > 200'000 / TERRACE_TEST_SHARE && TERRACE_TEST_SHARE > 1) continue;
    EXPECT_EQ(fnv1a(records_through(file, temp, 1)), hash);
    // Compressed by us, and from a pipe.
    const std::string laz = temp.path() / "copy.laz";
    copy_points(temp.path() / "copy.las", laz);
    EXPECT_EQ(fnv1a(records_through(laz, temp)), hash);
    FILE* pipe = popen(("cat '" + (folder / name).string() + "'").c_str(), "r");
    ASSERT_NE(pipe, nullptr);
    EXPECT_EQ(fnv1a(records_through("/proc/self/fd/" + std::to_string(fileno(pipe)), temp)), hash);
    pclose(pipe);
  }
  EXPECT_EQ(files_read, 26U);
}

TEST(LasReal, CompressedTwinsHaveTheSameRecords) {
  const std::filesystem::path folder = data_folder();
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no TERRACE_DATA";
  const TempFolder temp;
  EXPECT_EQ(fnv1a(records_through(folder / "autzen_trim.las", temp)), 0xb532bbaed0931254U);
  EXPECT_EQ(fnv1a(records_through(folder / "simple.las", temp)), 0xd3ecf47bd932612eU);
}

}  // namespace
}  // namespace terrace::stream
