// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "las_files.hpp"
#include "point_files.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {
namespace {

class Las : public ::testing::Test {
 protected:
  [[nodiscard]] std::string put_file(const std::string& name, const LasParts& parts) const {
    return write_text(folder_.path() / name, parts.bytes());
  }
  [[nodiscard]] std::string refusal(const LasParts& parts) const { return refusal(parts.bytes()); }
  [[nodiscard]] std::string refusal(const std::string& bytes) const {
    return error_of([&] { read_file(write_text(folder_.path() / "bad.las", bytes)); });
  }
  [[nodiscard]] std::string copy_of(const AllPoints& all,
                                    const std::string& name = "copy.las") const {
    const std::string path = folder_.path() / name;
    const auto writer = open_point_writer(path,
                                          {.attributes = all.info.attributes,
                                           .crs = [&all] { return all.info.crs; },
                                           .lattice = lattice_of(all.info)},
                                          {.replace = true});
    AllPoints world = all;
    to_world(all.info, world.points);
    writer->append(world.points);
    writer->finish();
    EXPECT_EQ(writer->rounding(), 0.0);
    return path;
  }

  TempFolder folder_;
};

/// One record of format 3: 7, -8, 9; intensity 0x1234; return 2 of 3, edge; class 17 withheld; ...
std::string record_of_format_3() {
  std::string record(34, '\0');
  put(record, 0, std::int32_t{7});
  put(record, 4, std::int32_t{-8});
  put(record, 8, std::int32_t{9});
  put(record, 12, std::uint16_t{0x1234});
  record[14] = static_cast<char>(2 | 3 << 3 | 1 << 7);
  record[15] = static_cast<char>(17 | 1 << 7);
  record[16] = -15;
  record[17] = static_cast<char>(200);
  put(record, 18, std::uint16_t{40000});
  put(record, 20, 1234.5);
  put(record, 28, std::uint16_t{65535});
  put(record, 30, std::uint16_t{256});
  put(record, 32, std::uint16_t{1});
  return record;
}

TEST_F(Las, DeliversFieldsAsAttributesOfTheirTypes) {
  const LasParts parts{.point_format = 3,
                       .record_bytes = 34,
                       .points = 1,
                       .records = record_of_format_3(),
                       .scale = {0.5, 0.25, 2},
                       .offset = {100, 200, 300}};
  const AllPoints all = read_file(put_file("a.las", parts));
  EXPECT_EQ(all.info.format, "las");
  EXPECT_EQ(all.info.points, 1U);
  EXPECT_FALSE(all.info.grid);
  ASSERT_EQ(all.points.size(), 1U);
  // As stored; the placement leads to the CRS.
  EXPECT_EQ(all.points.positions[0], (Point3{7, -8, 9}));
  EXPECT_EQ(world_point(all.info, all.points.positions[0]), (Point3{103.5, 198, 318}));
  const std::vector<std::pair<std::string, double>> wanted{{"intensity", 0x1234},
                                                           {"return_number", 2},
                                                           {"number_of_returns", 3},
                                                           {"scan_direction_flag", 0},
                                                           {"edge_of_flight_line", 1},
                                                           {"classification", 17},
                                                           {"synthetic", 0},
                                                           {"key_point", 0},
                                                           {"withheld", 1},
                                                           {"scan_angle_rank", -15},
                                                           {"user_data", 200},
                                                           {"point_source_id", 40000},
                                                           {"gps_time", 1234.5},
                                                           {"red", 65535},
                                                           {"green", 256},
                                                           {"blue", 1}};
  ASSERT_EQ(all.info.attributes.size(), wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const Channel& channel = all.info.attributes[i];
    EXPECT_EQ(channel.name, wanted[i].first);
    EXPECT_EQ(to_double(channel.type, all.points.payload.data() + all.info.attribute_offset(i)),
              wanted[i].second)
        << channel.name;
  }
  EXPECT_EQ(records_of(copy_of(all)), parts.records);
}

TEST_F(Las, RoundTripsRecordsOfAllFormats) {
  constexpr std::size_t kBytes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
  std::mt19937_64 random(1);
  for (unsigned format = 0; format <= 10; ++format) {
    for (const std::size_t extra : {std::size_t{0}, std::size_t{3}}) {
      LasParts parts{.point_format = format,
                     .minor = 4,
                     .record_bytes = kBytes[format] + extra,
                     .points = 777};
      parts.records.resize(parts.points * parts.record_bytes);
      for (char& byte : parts.records) byte = static_cast<char>(random());
      const AllPoints all = read_file(put_file("any.las", parts), {.block_points = 100});
      EXPECT_EQ(all.largest_block, 100U);
      const std::string copy = copy_of(all);
      EXPECT_EQ(records_of(copy), parts.records) << format << " + " << extra;
      const AllPoints again = read_file(copy);
      EXPECT_EQ(again.points.payload, all.points.payload);
      EXPECT_EQ(lattice_of(again.info), lattice_of(all.info));
    }
  }
}

TEST_F(Las, ReadsTheCrsFromGeoTiffKeys) {
  LasParts parts;
  std::string keys(24, '\0');
  const std::uint16_t shorts[] = {1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 32633};
  std::memcpy(keys.data(), shorts, sizeof shorts);
  parts.add_vlr("LASF_Projection", 34735, keys);
  parts.add_vlr("LASF_Projection", 2112, std::string("PROJCS[\"x\"]\0", 12));
  EXPECT_EQ(read_file(put_file("keys.las", parts)).info.crs.epsg, 32633);
  parts.encoding = 16;
  const Crs crs = read_file(put_file("wkt.las", parts)).info.crs;
  EXPECT_EQ(crs.epsg, 0);
  EXPECT_EQ(crs.wkt, "PROJCS[\"x\"]");
  Crs given;
  given.epsg = 4326;
  EXPECT_EQ(read_file(put_file("wkt.las", parts), {.crs = given}).info.crs, given);
}

TEST_F(Las, ReadsFilesWithDifferentOffsetsOntoOneLattice) {
  LasParts first{.points = 1, .records = std::string(28, '\0')}, second = first;
  second.offset = {1.25, -3, 0};
  const AllPoints both = read_all({put_file("1.las", first), put_file("2.las", second)});
  EXPECT_EQ(both.points.positions, (std::vector<Point3>{{0, 0, 0}, {125, -300, 0}}));
}

// Each coordinate stays what it is in its own file, whatever the scales and offsets.
TEST_F(Las, ReadsFilesOfAnyScaleAndOffsetTogether) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    const auto pick = [&](const std::vector<double>& values) {
      return values[random() % values.size()];
    };
    const std::size_t count = 2 + random() % 4;
    std::vector<std::string> files;
    std::vector<Point3> world;
    for (std::size_t i = 0; i < count; ++i) {
      LasParts parts{.points = 3, .records = std::string(3 * 28, '\0')};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        parts.scale[axis] = pick({0.01, 0.001, 0.00025, 0.005});
        parts.offset[axis] = pick({0, 5e4, 6.5e4 + 0.37, 6.5e4 + 0.0125, -7e4 - 0.0005});
        for (std::size_t k = 0; k < 3; ++k) {
          put(parts.records, 28 * k + 4 * axis, static_cast<std::int32_t>(random() % 20'000'001));
        }
      }
      files.push_back(put_file(std::to_string(i) + ".las", parts));
      const AllPoints one = read_file(files.back());
      for (const Point3& p : one.points.positions) world.push_back(world_point(one.info, p));
    }
    const AllPoints all = read_all(files);
    ASSERT_EQ(all.points.size(), world.size());
    EXPECT_TRUE(lattice_of(all.info)) << "all of these lie on a lattice";
    for (std::size_t i = 0; i < world.size(); ++i) {
      const Point3 place = world_point(all.info, all.points.positions[i]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(all.points.positions[i][axis], std::round(all.points.positions[i][axis]));
        EXPECT_NEAR(place[axis], world[i][axis], 1e-8) << i << ", "
                                                       << "xyz"[axis];
      }
    }
  }
}

TEST_F(Las, UsesTheCoarsestCommonLattice) {
  LasParts first{.points = 1, .records = std::string(28, '\0')}, second = first;
  const auto together = [&] {
    return read_all({put_file("1.las", first), put_file("2.las", second)});
  };
  second.scale = {0.001, 0.001, 0.00025};
  second.offset = {1, 1, 0.25};
  EXPECT_EQ(lattice_of(together().info), (Lattice{.scale = second.scale, .offset = {}}));
  // Equal steps in x and y stay equal even if only one axis needs finer ones.
  second.scale = first.scale;
  second.offset = {1.255, 0, 0};
  const AllPoints finer = together();
  EXPECT_EQ(lattice_of(finer.info), (Lattice{.scale = {0.005, 0.005, 0.01}, .offset = {}}));
  EXPECT_EQ(finer.points.positions, (std::vector<Point3>{{0, 0, 0}, {251, 0, 0}}));
  EXPECT_EQ(finer.info.note, "");
}

TEST_F(Las, UsesDoublesWithoutACommonLattice) {
  LasParts first{.points = 1, .records = std::string(28, '\0')}, second = first;
  first.offset = {1e5, 0, 0};
  put(second.records, 0, std::int32_t{12345});
  const auto together = [&] {
    return read_all({put_file("1.las", first), put_file("2.las", second)});
  };
  second.scale = {0.0123456789, 0.01, 0.01};  // like a range divided into 2^32 steps
  AllPoints all = together();
  EXPECT_EQ(all.info.coordinates[0].type, ScalarType::f64);
  EXPECT_EQ(all.points.positions, (std::vector<Point3>{{1e5, 0, 0}, {12345 * 0.0123456789, 0, 0}}));
  EXPECT_NE(all.info.note.find("kept as doubles"), std::string::npos);
  // On one lattice, but too far apart for 32 bits.
  second.scale = first.scale;
  second.offset = {1e8, 0, 0};
  second.bounds = {{1e8, 0, 0}, {1e8 + 1000, 0, 0}};
  first.bounds = {{1e5, 0, 0}, {1e5 + 1000, 0, 0}};
  all = together();
  EXPECT_EQ(all.points.positions, (std::vector<Point3>{{1e5, 0, 0}, {1e8 + 123.45, 0, 0}}));
  ASSERT_TRUE(all.info.stated_bounds);
  EXPECT_EQ(all.info.stated_bounds->max[0], 1e8 + 1000);
  // The offset moves if that suffices.
  second.offset = {3e7, 0, 0};
  second.bounds = {{3e7, 0, 0}, {3e7 + 1000, 0, 0}};
  all = together();
  ASSERT_TRUE(lattice_of(all.info));
  EXPECT_NEAR(world_point(all.info, all.points.positions[1])[0], 3e7 + 123.45, 1e-8);
  // If headers have no bounds, it depends on the points.
  first.bounds = second.bounds = {.min = {}, .max = {}};
  EXPECT_NE(error_of(together).find("out of range"), std::string::npos);
}

TEST_F(Las, UsesAsManyDecimalsAsThePointsNeed) {
  const auto written = [&](std::vector<Point3> points, std::optional<Box3> bounds = {},
                           bool degrees = false) {
    const std::string path = folder_.path() / "decimals.las";
    const auto system = [degrees] {
      Crs crs;
      crs.geographic = degrees;
      return crs;
    };
    const auto writer =
        open_point_writer(path, {.crs = system, .bounds = bounds}, {.replace = true});
    writer->append({.positions = points, .payload = {}});
    writer->finish();
    const AllPoints all = read_file(path);
    const Lattice lattice = *lattice_of(all.info);
    double largest = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Point3 world = world_point(all.info, all.points.positions[i]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double moved = std::abs(world[axis] - points[i][axis]);
        EXPECT_LE(moved, lattice.scale[axis] * 0.5000001);
        largest = std::max(largest, moved);
      }
    }
    EXPECT_EQ(writer->rounding() > 0, largest > 1e-9);
    return lattice.scale;
  };
  EXPECT_EQ(written({{691000.25, 5338000.125, 7}}), (Point3{0.001, 0.001, 0.001}));
  EXPECT_EQ(written({{-0.0946899, 0.0329874, 1.5}, {0.06, 0.18, 0}}), (Point3{1e-7, 1e-7, 0.001}));
  // 1/3 gets as many decimals as 32 bits allow within the bounds.
  Box3 bounds{.min = {0, 0, 0}, .max = {1e6, 1e6, 1}};
  EXPECT_EQ(written({{1 / 3.0, 0, 0}}, bounds), (Point3{0.001, 0.001, 0.001}));
  bounds.max[1] = 1e12;
  EXPECT_EQ(written({{1 / 3.0, 0, 0}}, bounds), (Point3{1000, 1000, 0.001}));
  // Without bounds more points may follow: millimetre steps cover 200 km, finer steps less.
  EXPECT_EQ(written({{4e5, 5e6, 7}, {5e5, 5.1e6 + 0.125, 7}}), (Point3{0.001, 0.001, 0.001}));
  EXPECT_EQ(written({{4e5, 5e6, 7}, {5e5 + 1 / 3.0, 5.1e6, 7}}), (Point3{0.001, 0.001, 0.001}));
  EXPECT_EQ(written({{4e5, 5e6, 7}, {4e5 + 1 / 3.0, 5e6 + 400, 7}}), (Point3{1e-4, 1e-4, 0.001}));
  EXPECT_EQ(written({{4e5, 5e6, 7}, {8e5, 5.1e6 + 0.125, 7}}), (Point3{0.01, 0.01, 0.001}));
  EXPECT_EQ(written({{8, 46, 7}, {9, 47 - 1 / 3.0, 7}}, {}, true), (Point3{1e-7, 1e-7, 0.001}));
}

TEST_F(Las, KeepsTheDecimalsOfLaterPoints) {
  for (const char* const name : {"sea.las", "sea.laz", "sea.copc.laz"}) {
    const std::string path = folder_.path() / name;
    PointBlock sea, land;
    for (int i = 0; i < 100; ++i) sea.positions.push_back({5e5 + i, 5.2e6 - i, 0});
    for (int i = 0; i < 100; ++i) land.positions.push_back({5e5 + i, 5.1e6 + 0.125, 0.37 + i});
    const auto writer = open_point_writer(path, {}, {.replace = true});
    writer->append(sea);
    writer->append(land);
    writer->finish();
    EXPECT_EQ(writer->rounding(), 0) << name;
    const AllPoints all = read_file(path);
    Box3 box;
    for (const Point3& p : all.points.positions) box.include(world_point(all.info, p));
    EXPECT_NEAR(box.max[2], 99.37, 1e-9) << name;
    EXPECT_NEAR(box.min[1], 5.1e6 + 0.125, 1e-9) << name;
  }
}

TEST_F(Las, ReportsDamageInOneLine) {
  const std::string good = LasParts{.points = 2, .records = std::string(56, '\0')}.bytes();
  EXPECT_EQ(refusal(good), "");
  EXPECT_NE(refusal(good.substr(0, 200)).find("ends in its header"), std::string::npos);
  EXPECT_NE(refusal(good.substr(0, good.size() - 1)).find("promises 2 points of 28 bytes"),
            std::string::npos);
  EXPECT_NE(refusal(LasParts{.point_format = 11}).find("point format 11"), std::string::npos);
  EXPECT_NE(refusal(LasParts{.record_bytes = 20}).find("take 28 bytes, not 20"), std::string::npos);
  EXPECT_NE(refusal(LasParts{.scale = {0, 1, 1}}).find("scale"), std::string::npos);
  EXPECT_NE(refusal(LasParts{.offset = {0, 0, NAN}}).find("finite"), std::string::npos);
  EXPECT_NE(refusal(LasParts{.minor = 4, .points = ~std::uint64_t{0}}).find("promises"),
            std::string::npos);
}

TEST_F(Las, RejectsCoordinatesThatAreNotFinite) {
  const std::string records(28, '\1');
  LasParts parts{.points = 1, .records = records};
  EXPECT_EQ(refusal(parts.bytes()), "");
  parts.scale = {0.01, 1e301, 0.01};
  EXPECT_NE(refusal(parts.bytes())
                .find("the scale and the offset of y give coordinates that are "
                      "not finite"),
            std::string::npos);
  parts.scale = {0.01, 0.01, 1e301};
  EXPECT_NE(refusal(parts.bytes()).find("of z give"), std::string::npos);
  parts.scale = {0.01, 0.01, 1e290};
  parts.offset = {0, 0, 1.79e308};
  EXPECT_EQ(refusal(parts.bytes()), "");
}

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
    std::vector<Damage> told;
    const auto read = [&](const std::string& bytes, unsigned threads) {
      told.clear();
      write_text(laz, bytes);
      const auto source = open_source(
          std::vector<std::string>{laz},
          {.threads = threads, .on_damage = [&](const Error& damage, std::uint64_t points) {
             told.push_back({damage.what(), points});
           }});
      AllPoints some = read_all(*source);
      std::uint64_t lost = 0;
      for (const Damage& damage : told) lost += damage.points;
      EXPECT_EQ(source->progress().lost, lost);
      EXPECT_EQ(some.points.size() + lost, 170000U);
      return some;
    };
    std::string bytes = good;
    for (std::size_t at = good.size() * 2 / 5; at < good.size() * 2 / 5 + 40; ++at)
      bytes[at] ^= 0x55;
    for (const unsigned threads : {1U, 2U, 5U}) {
      const AllPoints some = read(bytes, threads);
      ASSERT_EQ(told.size(), 1U);
      EXPECT_EQ(told[0].points, 50000U);
      EXPECT_NE(told[0].what.find("chunk 1, byte "), std::string::npos) << told[0].what;
      std::vector<Point3> rest = all.points.positions;
      rest.erase(rest.begin() + 50000, rest.begin() + 100000);
      EXPECT_TRUE(same_bits(some.points.positions, rest));
    }
    // Without their table, chunks are found one after the other, up to the end of the file.
    const AllPoints cut = read(good.substr(0, good.size() / 2), 2);
    ASSERT_EQ(told.size(), 2U);
    EXPECT_NE(told[0].what.find("chunk table"), std::string::npos) << told[0].what;
    EXPECT_GE(cut.points.size(), 50000U);
    std::vector<Point3> first = all.points.positions;
    first.resize(cut.points.size());
    EXPECT_TRUE(same_bits(cut.points.positions, first));
    // Truncated LAS is read up to the last complete record.
    const std::string las = read_text((folder_.path() / "a.las").string());
    const AllPoints records = read(las.substr(0, las.size() - 5 * parts.record_bytes - 3), 1);
    ASSERT_EQ(told.size(), 1U);
    EXPECT_EQ(told[0].points, 6U);
    EXPECT_EQ(records.points.size(), 169994U);
    // Nothing is reported for an intact file.
    EXPECT_EQ(read(good, 3).points.size(), 170000U);
    EXPECT_TRUE(told.empty());
  }
}

TEST_F(Las, RejectsValuesThatDoNotFit) {
  const std::string path = folder_.path() / "out.las";
  const auto error = [&](const PointHeader& header, const PointBlock& block) {
    return error_of([&] { open_point_writer(path, header, {})->append(block); });
  };
  const Lattice fine{.scale = {1e-9, 1, 1}};
  EXPECT_NE(
      error({.lattice = fine}, {.positions = {{3, 0, 0}}, .payload = {}}).find("out of range"),
      std::string::npos);
  EXPECT_NE(error({}, {.positions = {{NAN, 0, 0}}, .payload = {}}).find("out of range"),
            std::string::npos);
  PointBlock block{.positions = {{0, 0, 0}}, .payload = {}};
  append_values(block.payload, 32.0);
  const PointHeader classes{.attributes = {{.name = "classification", .type = ScalarType::f64},
                                           {.name = "scan_angle_rank", .type = ScalarType::i8}}};
  append_values(block.payload, std::int8_t{0});
  EXPECT_NE(error(classes, block).find("classification"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(Las, JoinsFilesWithEquivalentCrsIfTheCallerAgrees) {
  LasParts parts{.points = 1, .records = std::string(28, '\0')};
  std::vector<std::string> files;
  for (const char* const wkt :
       {"PROJCS[\"a\"]", "PROJCS[\"b\"]", "PROJCS[\"b\"]", "PROJCS[\"c\"]"}) {
    LasParts one = parts;
    one.add_vlr("LASF_Projection", 2112, wkt);
    files.push_back(
        write_text(folder_.path() / (std::to_string(files.size()) + ".las"), one.bytes()));
  }
  const auto read = [&](const SourceOptions& options) { read_all(files, options); };
  EXPECT_NE(error_of([&] { read({}); }).find("1.las"), std::string::npos);
  int asked = 0;
  SourceOptions options;
  options.same_crs = [&asked](const Crs& a, const Crs& b) {
    ++asked;
    return a.wkt.find("\"a\"") != a.wkt.npos && b.wkt.find("\"c\"") == b.wkt.npos;
  };
  EXPECT_NE(error_of([&] { read(options); }).find("3.las"), std::string::npos);
  EXPECT_EQ(asked, 2);  // once per definition
  files.pop_back();
  EXPECT_EQ(read_all(files, options).points.size(), 3u);
}

// The header's bounds may be wrong, so they select nothing.
TEST_F(Las, ReadsARegionWhateverBoundsTheHeaderStates) {
  LasParts parts{.points = 1, .records = std::string(28, '\0')};
  parts.bounds = {{1e6, 1e6, 1e6}, {1e6 + 1, 1e6 + 1, 1e6 + 1}};
  const std::string path = folder_.path() / "wrong_box.las";
  write_text(path, parts.bytes());
  SourceOptions options;
  options.selection.region = Box3{{-1, -1, -1}, {1, 1, 1}};
  EXPECT_EQ(read_file(path, options).points.size(), 1u);
}

TEST_F(Las, NotesRecordsThatTheHeaderDoesNotCount) {
  for (const std::uint32_t counted : {0u, 1u, 3u}) {
    LasParts parts{.points = counted, .records = std::string(3 * 28, '\0')};
    const std::string path = folder_.path() / "uncounted.las";
    write_text(path, parts.bytes());
    const std::string note = open_source(std::vector<std::string>{path})->info().note;
    EXPECT_EQ(note.empty(), counted == 3) << note;
    const std::string wanted = counted < 3 ? std::to_string(3 - counted) + " more follow" : "";
    EXPECT_NE(note.find(wanted), note.npos);
  }
}

}  // namespace
}  // namespace terrace::stream
