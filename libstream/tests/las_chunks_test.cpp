// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "las_testing.hpp"

namespace terrace::stream {
namespace {

TEST_F(Las, RoundTripsCompressedFilesOfSeveralChunks) {
  std::mt19937_64 random(2);
  for (const unsigned format : {3U, 7U}) {
    LasParts parts{.point_format = format,
                   .minor = 4,
                   .record_bytes = format == 3 ? std::size_t{35} : std::size_t{37},
                   .points = 120000};
    parts.records.resize(parts.points * parts.record_bytes);
    for (char& byte : parts.records) byte = static_cast<char>(random() % 7);
    const AllPoints all = read_file(put_file("a.las", parts));
    const std::string laz = copy_of(all, "copy.laz");
    for (const unsigned threads : {1U, 2U, 5U}) {
      const AllPoints again = read_file(laz, {.threads = threads});
      EXPECT_EQ(again.info.format, "laz");
      EXPECT_TRUE(same_bits(again.points.positions, all.points.positions));
      EXPECT_EQ(again.points.payload, all.points.payload);
    }
    // Damage is found in its chunk, by any number of threads.
    std::string bytes = read_text(laz);
    const std::string good = bytes;
    bytes[bytes.size() * 3 / 4] ^= 0x55;
    write_text(laz, bytes);
    for (const unsigned threads : {1U, 2U}) {
      const std::string error = error_of([&] { read_file(laz, {.threads = threads}); });
      EXPECT_NE(error.find("chunk "), std::string::npos) << error;
      EXPECT_NE(error.find("byte "), std::string::npos) << error;
    }
    write_text(laz, good.substr(0, good.size() / 2));
    EXPECT_NE(error_of([&] { read_file(laz); }).find("chunk table"), std::string::npos);
  }
}

// Intact chunks remain, with any number of threads; the damaged one is named.
TEST_F(Las, SkipsDamagedChunksOnRequest) {
  std::mt19937_64 random(3);
  for (const unsigned format : {3U, 7U}) {
    SCOPED_TRACE(format);
    LasParts parts{.point_format = format,
                   .minor = 4,
                   .record_bytes = format == 3 ? std::size_t{35} : std::size_t{37},
                   .points = 170000};
    parts.records.resize(parts.points * parts.record_bytes);
    for (char& byte : parts.records) byte = static_cast<char>(random() % 7);
    const AllPoints all = read_file(put_file("a.las", parts));
    const std::string laz = copy_of(all, "copy.laz");
    const std::string good = read_text(laz);
    struct Damage {
      std::string what;
      std::uint64_t points;
    };
    std::vector<Damage> reports;
    const auto read = [&](const std::string& bytes, unsigned threads) {
      reports.clear();
      write_text(laz, bytes);
      const auto source = open_source(
          std::vector<std::string>{laz},
          {.threads = threads, .on_damage = [&](const Error& damage, std::uint64_t points) {
             reports.push_back({damage.what(), points});
           }});
      AllPoints intact = read_all(*source);
      std::uint64_t lost = 0;
      for (const Damage& damage : reports) lost += damage.points;
      EXPECT_EQ(source->progress().lost, lost);
      EXPECT_EQ(intact.points.size() + lost, 170000U);
      return intact;
    };
    std::string bytes = good;
    for (std::size_t at = good.size() * 2 / 5; at < good.size() * 2 / 5 + 40; ++at)
      bytes[at] ^= 0x55;
    for (const unsigned threads : {1U, 2U, 5U}) {
      const AllPoints intact = read(bytes, threads);
      ASSERT_EQ(reports.size(), 1U);
      EXPECT_EQ(reports[0].points, 50000U);
      EXPECT_NE(reports[0].what.find("chunk 1, byte "), std::string::npos) << reports[0].what;
      std::vector<Point3> rest = all.points.positions;
      rest.erase(rest.begin() + 50000, rest.begin() + 100000);
      EXPECT_TRUE(same_bits(intact.points.positions, rest));
    }
    // Without their table, chunks are found one after the other, up to the end of the file.
    const AllPoints cut = read(good.substr(0, good.size() / 2), 2);
    ASSERT_EQ(reports.size(), 2U);
    EXPECT_NE(reports[0].what.find("chunk table"), std::string::npos) << reports[0].what;
    EXPECT_GE(cut.points.size(), 50000U);
    std::vector<Point3> first = all.points.positions;
    first.resize(cut.points.size());
    EXPECT_TRUE(same_bits(cut.points.positions, first));
    // Truncated LAS is read up to the last complete record.
    const std::string las = read_text((folder_.path() / "a.las").string());
    const AllPoints records = read(las.substr(0, las.size() - 5 * parts.record_bytes - 3), 1);
    ASSERT_EQ(reports.size(), 1U);
    EXPECT_EQ(reports[0].points, 6U);
    EXPECT_EQ(records.points.size(), 169994U);
    // Nothing is reported for an intact file.
    EXPECT_EQ(read(good, 3).points.size(), 170000U);
    EXPECT_TRUE(reports.empty());
  }
}

}  // namespace
}  // namespace terrace::stream
