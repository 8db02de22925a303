// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <initializer_list>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "ept_parts.hpp"
#include "octree_testing.hpp"
#include "point_files.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;

TEST(Ept, ReadsTheTypesOfItsSchema) {
  const TempFolder folder;
  const std::string file = small_parts().write(folder.path());
  const AllPoints all = read_file(file);
  EXPECT_EQ(all.info.format, "ept");
  EXPECT_EQ(all.info.points, 6u);
  EXPECT_EQ(all.info.crs.epsg, 25832);
  EXPECT_EQ(all.info.crs.vertical_epsg, 7837);
  EXPECT_EQ(all.info.octree->spacing, 1.0);
  EXPECT_EQ(all.info.octree->depths, 3u);
  EXPECT_EQ(all.info.octree->nodes, 3u);
  ASSERT_EQ(all.info.attributes.size(), 2u);
  EXPECT_EQ(all.info.attributes[0], (Channel{.name = "intensity", .type = ScalarType::u16}));
  EXPECT_EQ(all.info.attributes[1], (Channel{.name = "Custom value", .type = ScalarType::f64}));
  const std::vector<Point3> places{{-8, -8, 0}, {7, 7, 31},  {-7, -7, 1},
                                   {-6, -7, 2}, {-5, -5, 3}, {4, -8, 4}};
  EXPECT_EQ(all.points.positions, places);
  EXPECT_EQ(world_point(all.info, places[1]), (Point3{7.5, 7.5, 7.75}));
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(all.values<double>(1)[i], 0.1 * places[i][0]);
  }
  expect_parts_of_regions({file}, all);
  expect_coarser_parts(file);
}

// The intensity comes first, and equals the number of points of the node.
TEST(Ept, DoesNotTakeRecordsForGzip) {
  const TempFolder folder;
  EptParts parts;
  const std::size_t count = 0x8b1f;
  parts.add("0-0-0-0.bin", std::vector<std::array<std::int32_t, 3>>(count, {1, 2, 3}));
  parts.hierarchy["0-0-0-0"] = R"({"0-0-0-0": )" + std::to_string(count) + "}";
  EXPECT_EQ(read_file(parts.write(folder.path())).points.size(), count);
}

TEST(Ept, AFolderWithEptJsonIsOneInput) {
  const TempFolder folder;
  const std::string inside = small_parts().write(folder.path() / "all" / "scan");
  for (const fs::path& name : {folder.path() / "all" / "scan", folder.path() / "all"}) {
    EXPECT_EQ(read_file(name).info.files, std::vector<std::string>{inside});
  }
  // Together with another data set, whose lattice begins elsewhere.
  EptParts other = small_parts();
  other.metadata["schema"][1]["offset"] = 104;
  other.write(folder.path() / "all" / "scan2");
  const AllPoints both = read_file(folder.path() / "all");
  EXPECT_EQ(both.points.size(), 12u);
  EXPECT_EQ(both.points.positions[6], (Point3{192, -8, 0}));
}

TEST(Ept, ReadsCoordinatesOfAnyType) {
  for (const char* type : {"float", "signed"}) {
    for (const int size : {4, 8}) {
      EptParts parts;
      parts.metadata["schema"] = Json::array();
      for (const char* name : {"X", "Y", "Z"}) {
        parts.metadata["schema"].push_back({{"name", name}, {"type", type}, {"size", size}});
      }
      std::vector<std::byte> bytes;
      for (const int value : {1, 2, 3}) {
        if (size == 4) {
          *type == 'f' ? append_values(bytes, static_cast<float>(value))
                       : append_values(bytes, std::int32_t{value});
        } else {
          *type == 'f' ? append_values(bytes, static_cast<double>(value))
                       : append_values(bytes, std::int64_t{value});
        }
      }
      parts.nodes["0-0-0-0.bin"] = {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
      parts.hierarchy["0-0-0-0"] = R"({"0-0-0-0": 1})";
      parts.metadata["points"] = 1;
      const TempFolder folder;
      EXPECT_EQ(read_file(parts.write(folder.path())).points.positions,
                std::vector<Point3>({{1, 2, 3}}));
      // NaN, and more than a double can hold.
      if (*type == 'f' || size == 8) {
        std::fill_n(parts.nodes["0-0-0-0.bin"].begin(), size, *type == 'f' ? '\xff' : '\x7f');
        const TempFolder damaged;
        EXPECT_NE(error_of([&] {
                    read_file(parts.write(damaged.path()));
                  }).find("its x is not a number that can be kept exactly"),
                  std::string::npos);
      }
    }
  }
}

/// LAZ nodes must agree: one that lacks a point or is on another lattice is refused.
TEST(Ept, RejectsLazNodesThatDisagree) {
  const auto read = [](std::size_t points, double step) {
    const TempFolder folder;
    EptParts parts = small_parts();
    parts.metadata["dataType"] = "laszip";
    parts.metadata["srs"] = Json::object();
    const std::string file = parts.write(folder.path());
    PointHeader header{.attributes = {{.name = "intensity", .type = ScalarType::u16}}};
    header.crs = [] {
      Crs crs;
      crs.wkt = "LOCAL_CS[\"made\"]";
      return crs;
    };
    const auto write = [&](const char* name, std::size_t count, double scale) {
      header.lattice = Lattice{.scale = {scale, scale, scale}, .offset = {}};
      const auto writer = open_point_writer((folder.path() / "ept-data" / name).string(), header);
      PointBlock block;
      for (std::size_t i = 0; i < count; ++i) {
        block.positions.push_back({1, 2, static_cast<double>(i)});
        append_values(block.payload, static_cast<std::uint16_t>(i));
      }
      writer->append(block);
      writer->finish();
    };
    write("0-0-0-0.laz", 2, 1);
    write("1-0-0-0.laz", points, step);
    write("2-3-0-0.laz", 1, 1);
    AllPoints all;
    const std::string error = error_of([&] { all = read_file(file, {.threads = 2}); });
    if (error.empty()) {
      EXPECT_EQ(all.points.size(), 6u);
      EXPECT_EQ(all.info.crs.wkt, "LOCAL_CS[\"made\"]");
      EXPECT_EQ(all.values<std::uint16_t>(0)[4], 2);
    }
    return error;
  };
  EXPECT_EQ(read(3, 1), "");
  EXPECT_NE(read(2, 1).find("counts 3 points, but the file has 2"), std::string::npos);
  EXPECT_NE(read(3, 0.5).find("scale or offset"), std::string::npos);
}

/// Returns a copy of the data set with nodes of plain records.
std::string write_by_schema(const fs::path& source, const fs::path& folder, bool zstandard) {
  Json metadata = Json::parse(read_text(source / "ept.json"));
  metadata["dataType"] = zstandard ? "zstandard" : "binary";
  fs::create_directories(folder / "ept-data");
  fs::copy(source / "ept-hierarchy", folder / "ept-hierarchy");
  for (const auto& entry : fs::directory_iterator(source / "ept-data")) {
    const AllPoints node = read_file(entry.path());
    // The headers' offsets differ from those of the schema.
    const Lattice lattice = lattice_of(node.info).value();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      metadata["schema"][axis]["offset"] = lattice.offset[axis];
    }
    std::string bytes;
    for (std::size_t i = 0; i < node.points.size(); ++i) {
      std::vector<std::byte> record;
      for (const double value : node.points.positions[i]) {
        append_values(record, static_cast<std::int32_t>(value));
      }
      std::size_t offset = i * node.info.payload_size();
      for (const Channel& channel : node.info.attributes) {
        const std::size_t size = size_of(channel.type);
        const std::byte* const at = node.points.payload.data() + offset;
        offset += size;
        if (channel.name == "scan_angle_rank") {
          append_values(record, static_cast<float>(to_double(channel.type, at)));
        } else if (channel.name != "synthetic" && channel.name != "key_point" &&
                   channel.name != "withheld") {
          record.insert(record.end(), at, at + size);
        }
      }
      bytes.append(reinterpret_cast<const char*>(record.data()), record.size());
    }
    const std::string name = entry.path().stem().string() + (zstandard ? ".zst" : ".bin");
    write_text(folder / "ept-data" / name, zstandard ? compressed(bytes) : bytes);
  }
  return write_text(folder / "ept.json", metadata.dump());
}

/// With misplaced bounds, a region would lose all its points.
TEST(Ept, RejectsRegionsIfTheBoundsAreWrong) {
  EptParts parts = small_parts();
  SourceOptions options;
  options.selection.region = Box3{{0, 0, 0}, {1, 1, 8}};
  const TempFolder folder;
  EXPECT_EQ(read_file(parts.write(folder.path()), options).points.size(), 3u);
  parts.metadata["bounds"] = {100, 0, 0, 108, 8, 8};
  const std::string file = parts.write(folder.path());
  EXPECT_EQ(read_file(file).points.size(), 6u);
  EXPECT_NE(error_of([&] { read_file(file, options); }).find("outside its cube"),
            std::string::npos);
}

TEST(Ept, ReadsLoneStarInAllThreeEncodings) {
  const char* const data = std::getenv("TERRACE_DATA");
  if (data == nullptr) GTEST_SKIP() << "no TERRACE_DATA";
  const fs::path folder = fs::path(data) / "lidar" / "ept-lone-star";
  const AllPoints all = read_file(folder);
  EXPECT_EQ(all.info.points, 518862u);
  EXPECT_EQ(all.info.octree->nodes, 13u);
  EXPECT_EQ(all.info.octree->depths, 4u);
  EXPECT_EQ(all.info.octree->spacing, 44.0 / 128);
  EXPECT_NE(all.info.crs.wkt.find("NAD83 / UTM zone 12N"), std::string::npos);
  // The nodes are LAZ files: read as LAZ they give the same points.
  std::vector<std::string> nodes;
  for (const auto& entry : fs::directory_iterator(folder / "ept-data")) {
    nodes.push_back(entry.path().string());
  }
  EXPECT_TRUE(records(all) == records(read_all(nodes)));
  expect_parts_of_regions({(folder / "ept.json").string()}, all);
  expect_coarser_parts((folder / "ept.json").string());

  const auto values_of = [](const AllPoints& points, std::initializer_list<const char*> names) {
    std::vector<std::size_t> hashes;  // hashes
    std::vector<std::pair<ScalarType, std::size_t>> columns;
    for (const char* const name : names) {
      const auto& attributes = points.info.attributes;
      const auto channel = std::find_if(attributes.begin(), attributes.end(),
                                        [&](const Channel& c) { return c.name == name; });
      EXPECT_NE(channel, attributes.end()) << name;
      if (channel == attributes.end()) return hashes;
      const auto number = static_cast<std::size_t>(channel - attributes.begin());
      columns.emplace_back(channel->type, points.info.attribute_offset(number));
    }
    const std::size_t bytes = points.info.payload_size();
    std::vector<double> values;
    for (std::size_t i = 0; i < points.points.size(); ++i) {
      const Point3 at = world_point(points.info, points.points.positions[i]);
      // Compare in steps, because offsets differ.
      values.clear();
      for (const double value : at) values.push_back(std::round(value / 0.00025));
      for (const auto& [type, offset] : columns) {
        values.push_back(to_double(type, points.points.payload.data() + i * bytes + offset));
      }
      const std::string_view text(reinterpret_cast<const char*>(values.data()),
                                  values.size() * sizeof(double));
      hashes.push_back(std::hash<std::string_view>()(text));
    }
    std::sort(hashes.begin(), hashes.end());
    return hashes;
  };
  const auto shared = {"intensity", "return_number", "classification", "gps_time"};
  EXPECT_TRUE(values_of(all, shared) ==
              values_of(read_file(folder.parent_path() / "lone-star.copc.laz"), shared));

  const auto common = {"intensity",         "return_number",
                       "number_of_returns", "scan_direction_flag",
                       "classification",    "edge_of_flight_line",
                       "user_data",         "point_source_id",
                       "gps_time",          "OriginId"};
  const TempFolder output;
  for (const bool zstandard : {false, true}) {
    const std::string file =
        write_by_schema(folder, output.path() / (zstandard ? "zst" : "bin"), zstandard);
    const AllPoints other = read_file(file, {.threads = 2});
    EXPECT_EQ(other.info.attributes.size(), 11u);
    EXPECT_TRUE(values_of(other, common) == values_of(all, common));
    EXPECT_TRUE(other.points.payload == read_file(file).points.payload);
  }
}

}  // namespace
}  // namespace terrace::stream
