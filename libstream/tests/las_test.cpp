// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "las_testing.hpp"

namespace terrace::stream {
namespace {

/// Returns a record of format 3 with the values that the next test expects.
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
  const std::vector<std::pair<std::string, double>> expected{{"intensity", 0x1234},
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
  ASSERT_EQ(all.info.attributes.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Channel& channel = all.info.attributes[i];
    EXPECT_EQ(channel.name, expected[i].first);
    EXPECT_EQ(to_double(channel.type, all.points.payload.data() + all.info.attribute_offset(i)),
              expected[i].second)
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
  Crs override_crs;
  override_crs.epsg = 4326;
  EXPECT_EQ(read_file(put_file("wkt.las", parts), {.crs = override_crs}).info.crs, override_crs);
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
  int calls = 0;
  SourceOptions options;
  options.same_crs = [&calls](const Crs& a, const Crs& b) {
    ++calls;
    return a.wkt.find("\"a\"") != a.wkt.npos && b.wkt.find("\"c\"") == b.wkt.npos;
  };
  EXPECT_NE(error_of([&] { read(options); }).find("3.las"), std::string::npos);
  EXPECT_EQ(calls, 2);  // once per definition
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
    const std::string expected = counted < 3 ? std::to_string(3 - counted) + " more follow" : "";
    EXPECT_NE(note.find(expected), note.npos);
  }
}

}  // namespace
}  // namespace terrace::stream
