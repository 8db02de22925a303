// SPDX-License-Identifier: Apache-2.0 Scans by third parties, if TERRACE_DATA names a folder that
// contains them.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "point_files.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {
namespace {

struct Scan {
  const char* file;
  std::size_t points, attributes;
  Point3 min, max;  ///< to six digits, as published with the files
};

const Scan kScans[] = {
    {"armadillo_tm.ply", 38294, 3, {-13.6616, -12.3814, -48.8636}, {11.1206, 95.4079, 57.714}},
    {"bun_zipper.ply",
     35947,
     2,
     {-0.0946899, 0.0329874, -0.0618736},
     {0.0610091, 0.187321, 0.0587997}},
    {"dragon_vrip_res2.ply.gz",
     100250,
     0,
     {-0.108188, 0.0527392, -0.0503454},
     {0.0964062, 0.197139, 0.0411367}},
    {"horse.ply", 48485, 4, {-0.042003, -0.0916705, -0.076418}, {0.042003, 0.0916705, 0.076418}},
    {"igea.ply", 134345, 0, {-0.034556, -0.049669, -0.049538}, {0.034556, 0.049669, 0.049538}},
    {"lucy_100k.ply", 49987, 0, {225.906, -388.421, -605.89}, {1156.03, 145.348, 991.332}},
    {"bunny_range/bun000.ply.gz",
     40256,
     0,
     {-0.09475, 0.0357363, -0.0586982},
     {0.061, 0.18794, 0.0587228}},
    {"bunny_range/bun180.ply.gz",
     40251,
     0,
     {-0.0615, 0.0340917, -0.0339278},
     {0.09475, 0.187605, 0.0611871}},
};

/// Reads a file, through a pipe if it is compressed.
AllPoints read_scan(const std::filesystem::path& path) {
  if (path.extension() != ".gz") return read_file(path);
  FILE* pipe = popen(("gzip -dc '" + path.string() + "'").c_str(), "r");
  EXPECT_NE(pipe, nullptr);
  AllPoints all = read_file("/proc/self/fd/" + std::to_string(fileno(pipe)));
  // Data after the vertices is not read: gzip may end with a closed pipe.
  pclose(pipe);
  return all;
}

TEST(ScanReal, PointsMatchThePublishedFacts) {
  const char* data = std::getenv("TERRACE_DATA");
  const auto folder = std::filesystem::path(data == nullptr ? "" : data) / "scan";
  if (data == nullptr || !std::filesystem::is_directory(folder)) GTEST_SKIP() << "no TERRACE_DATA";
  const TempFolder temp;
  std::size_t files_read = 0;
  for (const Scan& scan : kScans) {
    SCOPED_TRACE(scan.file);
    if (!std::filesystem::exists(folder / scan.file)) continue;
    ++files_read;
    const AllPoints all = read_scan(folder / scan.file);
    EXPECT_EQ(all.info.format, "ply");
    EXPECT_EQ(all.points.size(), scan.points);
    EXPECT_EQ(all.info.attributes.size(), scan.attributes);
    Box3 box;
    for (const Point3& p : all.points.positions) box.include(p);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(box.min[axis], scan.min[axis], std::abs(scan.min[axis]) * 6e-6);
      EXPECT_NEAR(box.max[axis], scan.max[axis], std::abs(scan.max[axis]) * 6e-6);
    }
    for (const std::string format : {"xyz", "csv", "ply", "ply-ascii"}) {
      const auto path = temp.path() / "copy";
      const auto writer = open_point_writer(path, {.attributes = all.info.attributes},
                                            {.format = format, .replace = true});
      writer->append(all.points);
      writer->finish();
      const AllPoints copy = read_file(path);
      EXPECT_TRUE(same_bits(copy.points.positions, all.points.positions)) << format;
      ASSERT_EQ(copy.info.attributes.size(), scan.attributes);
      if (!format.starts_with("ply")) continue;
      for (std::size_t i = 0; i < scan.attributes; ++i) {
        EXPECT_EQ(copy.info.attributes[i].name, all.info.attributes[i].name);
      }
      EXPECT_EQ(copy.points.payload, all.points.payload);
    }
  }
  EXPECT_GT(files_read, 0u);
}

}  // namespace
}  // namespace terrace::stream
