// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <zstd.h>

#include "octree_testing.hpp"
#include "point_files.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

std::string compressed(std::string_view bytes) {
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3));
  return out;
}

/// A data set of 8 x 8 x 8 units with the corner at 0, of records that a test writes itself.
struct EptParts {
  Json metadata = {
      {"version", "1.0.0"},
      {"hierarchyType", "json"},
      {"dataType", "binary"},
      {"bounds", {0, 0, 0, 8, 8, 8}},
      {"boundsConforming", {0, 0, 0, 8, 8, 8}},
      {"span", 8},
      {"points", 0},
      {"srs", {{"authority", "EPSG"}, {"horizontal", "25832"}, {"vertical", "7837"}}},
      {"schema",
       {{{"name", "Intensity"}, {"type", "unsigned"}, {"size", 2}},
        {{"name", "X"}, {"type", "signed"}, {"size", 4}, {"scale", 0.5}, {"offset", 4}},
        {{"name", "Y"}, {"type", "signed"}, {"size", 4}, {"scale", 0.5}, {"offset", 4}},
        {{"name", "Z"}, {"type", "signed"}, {"size", 4}, {"scale", 0.25}},
        {{"name", "Of its own"}, {"type", "float"}, {"size", 8}}}}};
  std::map<std::string, std::string> hierarchy{{"0-0-0-0", R"({"0-0-0-0": 0})"}};
  std::map<std::string, std::string> nodes{};  ///< by file name

  /// Points of a node at a place in stored steps.
  void add(const std::string& file, const std::vector<std::array<std::int32_t, 3>>& places) {
    std::vector<std::byte> bytes;
    for (const auto& p : places) {
      append_values(bytes, static_cast<std::uint16_t>(places.size()), p[0], p[1], p[2], 0.1 * p[0]);
    }
    nodes[file] = {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    metadata["points"] = metadata["points"].get<int>() + static_cast<int>(places.size());
  }
  std::string write(const fs::path& folder) const {
    fs::create_directories(folder / "ept-data");
    fs::create_directories(folder / "ept-hierarchy");
    for (const auto& [name, text] : hierarchy) {
      write_text(folder / "ept-hierarchy" / (name + ".json"), text);
    }
    for (const auto& [name, bytes] : nodes) write_text(folder / "ept-data" / name, bytes);
    return write_text(folder / "ept.json", metadata.dump());
  }
};

/// Three nodes; the last is told by a file of the hierarchy of its own.
EptParts small_parts() {
  EptParts parts;
  parts.add("0-0-0-0.bin", {{-8, -8, 0}, {7, 7, 31}});
  parts.add("1-0-0-0.bin", {{-7, -7, 1}, {-6, -7, 2}, {-5, -5, 3}});
  parts.add("2-3-0-0.bin", {{4, -8, 4}});
  parts.hierarchy["0-0-0-0"] = R"({"0-0-0-0": 2, "1-0-0-0": 3, "1-1-0-0": 0, "2-3-0-0": -1})";
  parts.hierarchy["2-3-0-0"] = R"({"2-3-0-0": 1})";
  return parts;
}

TEST(Ept, ReadsWhatItsSchemaSays) {
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
  EXPECT_EQ(all.info.attributes[1], (Channel{.name = "Of its own", .type = ScalarType::f64}));
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

// The intensity comes first, and is the number of points of the node.
TEST(Ept, RecordsThatBeginLikeGzipAreRecords) {
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
  // Beside another, on a lattice that begins elsewhere.
  EptParts other = small_parts();
  other.metadata["schema"][1]["offset"] = 104;
  other.write(folder.path() / "all" / "scan2");
  const AllPoints both = read_file(folder.path() / "all");
  EXPECT_EQ(both.points.size(), 12u);
  EXPECT_EQ(both.points.positions[6], (Point3{192, -8, 0}));
}

TEST(Ept, CoordinatesMayBeOfAnyType) {
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
      // Not a number, and more than a double holds.
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

TEST(Ept, RefusesWhatCannotBe) {
  const auto refusal = [](auto change) {
    EptParts parts = small_parts();
    change(parts);
    const TempFolder folder;
    const std::string file = parts.write(folder.path());
    return error_of([&] { read_file(file); });
  };
  const auto has = [](const std::string& text, std::string_view part) {
    return text.find(part) != text.npos && text.find('\n') == text.npos;
  };
  EXPECT_EQ(refusal([](EptParts&) {}), "");
  // ept.json
  const auto with = [&](const char* name, const Json& value) {
    return refusal([&](EptParts& parts) { parts.metadata[name] = value; });
  };
  const auto with_dimension = [&](std::size_t i, const Json& value) {
    return refusal([&](EptParts& parts) { parts.metadata["schema"][i].update(value); });
  };
  EXPECT_PRED2(has, with("version", "2.0.0"), "version");
  EXPECT_PRED2(has, with("version", 1), "version");
  EXPECT_PRED2(has, with("dataType", "laz"), "dataType");
  EXPECT_PRED2(has, with("hierarchyType", "gzip"), "hierarchyType");
  EXPECT_PRED2(has, with("points", -1), "points");
  EXPECT_PRED2(has, with("points", 5), "more points than ept.json promises");
  EXPECT_PRED2(has, with("points", 7), "have 6 points, but ept.json promises 7");
  EXPECT_PRED2(has, with("span", 0), "span");
  EXPECT_PRED2(has, with("span", 0.5), "span");
  EXPECT_PRED2(has, with("bounds", {0, 0, 0, 8, 8}), "bounds");
  EXPECT_PRED2(has, with("bounds", {0, 0, 0, 8, 8, "8"}), "bounds");
  EXPECT_PRED2(has, with("bounds", {0, 0, 0, 8, 8, 9}), "bounds");
  EXPECT_PRED2(has, with("bounds", {8, 0, 0, 0, 8, 8}), "bounds");
  EXPECT_PRED2(has, with("bounds", {-1.7e308, 0, 0, 1.7e308, 8, 8}), "bounds");
  EXPECT_PRED2(has, with("schema", Json::object()), "schema");
  EXPECT_PRED2(has, with("schema", Json::array()), "lacks X, Y or Z");
  EXPECT_PRED2(has, with("schema", {1}), "is not an object");
  EXPECT_PRED2(has, with("srs", 1), "srs");
  EXPECT_PRED2(has, with("srs", {{"authority", "EPSG"}, {"horizontal", "x"}}), "srs");
  EXPECT_PRED2(has, with_dimension(1, {{"name", "Y"}}), "once more");
  EXPECT_PRED2(has, with_dimension(4, {{"name", "Intensity"}}), "once more");
  EXPECT_PRED2(has, with_dimension(4, {{"name", ""}}), "has no name");
  EXPECT_PRED2(has, with_dimension(4, {{"type", "text"}}), "is not a type");
  EXPECT_PRED2(has, with_dimension(4, {{"size", 3}}), "is not a type");
  EXPECT_PRED2(has, with_dimension(4, {{"size", 2}}), "is not a type");
  EXPECT_PRED2(has, with_dimension(1, {{"scale", 0}}), "scale");
  EXPECT_PRED2(has, with_dimension(1, {{"scale", 5e-324}}), "scales");
  EXPECT_PRED2(has, with_dimension(1, {{"scale", "1"}}), "scale");
  Json deep = 1;
  for (int i = 0; i < 100; ++i) deep = Json::array({deep});
  EXPECT_PRED2(has, with("more", deep), "nested too deeply");
  {
    const TempFolder folder;
    const std::string file = small_parts().write(folder.path());
    write_text(file, "{\"bounds\": ");
    EXPECT_PRED2(has, error_of([&] { read_file(file); }), "not JSON");
    write_text(file, "");
    EXPECT_PRED2(has, error_of([&] { read_file(file); }), "ept.json");
    write_text(file, "[1, 2, 3]");
    EXPECT_PRED2(has, error_of([&] { read_file(file); }), "object");
  }
  // The hierarchy.
  const auto with_root = [&](const std::string& text) {
    return refusal([&](EptParts& parts) { parts.hierarchy["0-0-0-0"] = text; });
  };
  EXPECT_PRED2(has, with_root(R"({"0-0-0-0": 2, "0-0-0-0": 3, "2-3-0-0": -1})"), "is there twice");
  EXPECT_PRED2(has, with_root(R"({"0-0-0-0": -1})"), "referred to twice");
  EXPECT_PRED2(has, with_root(R"({"2-3-0-0": -1, "02-3-0-0": -1})"), "referred to twice");
  EXPECT_PRED2(has, with_root(R"({"0-0-0-0": -2})"), "has -2 points");
  EXPECT_PRED2(has, with_root(R"({"0-0-0-0": 1.5})"), "numbers of points");
  EXPECT_PRED2(has, with_root(R"({"0-0-0-0": 18446744073709551615})"), "more points");
  EXPECT_PRED2(has, with_root(R"({"0-0-0-0": {}})"), "numbers of points");
  EXPECT_PRED2(has, with_root("[1]"), "numbers of points");
  EXPECT_PRED2(has, with_root("1"), "numbers of points");
  EXPECT_PRED2(has, with_root("{"), "not JSON");
  EXPECT_PRED2(has, with_root(""), "not JSON");
  for (const char* name : {"0", "0-0-0", "0-0-0-0-0", "1-2-0-0", "31-0-0-0", "1-0-0--1", "a-0-0-0",
                           "../../x", "4294967296-0-0-0", ""}) {
    EXPECT_PRED2(has, with_root(std::string("{\"") + name + "\": 1}"), "not a node");
  }
  EXPECT_PRED2(has, refusal([](EptParts& parts) { parts.hierarchy.erase("2-3-0-0"); }),
               "2-3-0-0.json");
  EXPECT_PRED2(has, refusal([](EptParts& parts) {
                 parts.hierarchy["2-3-0-0"] = R"({"2-3-0-0": 1, "0-0-0-0": -1})";
               }),
               "referred to twice");
  // The nodes, in all three forms.
  EXPECT_PRED2(has, refusal([](EptParts& parts) { parts.nodes.erase("1-0-0-0.bin"); }),
               "1-0-0-0.bin");
  EXPECT_PRED2(has, refusal([](EptParts& parts) { parts.nodes["1-0-0-0.bin"] += "x"; }),
               "the hierarchy counts 3 points");
  EXPECT_PRED2(has, refusal([](EptParts& parts) { parts.nodes["1-0-0-0.bin"].resize(44); }),
               "the hierarchy counts 3 points");
  const auto with_zstd = [&](auto change) {
    return refusal([&](EptParts& parts) {
      parts.metadata["dataType"] = "zstandard";
      for (const auto& [name, bytes] : std::map(parts.nodes)) {
        parts.nodes[name.substr(0, name.size() - 3) + "zst"] = compressed(bytes);
      }
      change(parts.nodes["1-0-0-0.zst"], parts.nodes["1-0-0-0.bin"]);
    });
  };
  EXPECT_EQ(with_zstd([](std::string&, const std::string&) {}), "");
  EXPECT_EQ(with_zstd([](std::string& node, const std::string& bytes) {
              node = compressed(bytes.substr(0, 5)) + compressed(bytes.substr(5));
            }),
            "");
  EXPECT_PRED2(has, with_zstd([](std::string& node, const std::string& bytes) {
                 node = compressed(bytes + "x");
               }),
               "has more");
  EXPECT_PRED2(has, with_zstd([](std::string& node, const std::string& bytes) {
                 node = compressed(bytes.substr(1));
               }),
               "ends before");
  EXPECT_PRED2(has, with_zstd([](std::string& node, const std::string&) { node.pop_back(); }),
               "is cut off");
  EXPECT_PRED2(has, with_zstd([](std::string& node, const std::string&) { node.clear(); }),
               "ends before");
  EXPECT_PRED2(has, with_zstd([](std::string& node, const std::string&) { node[0] ^= 1; }),
               "zstandard: ");
  EXPECT_PRED2(has, with("dataType", "laszip"), "0-0-0-0.laz");
}

/// Of nodes written as LAZ: one of them with a point less, or on another lattice, is refused.
TEST(Ept, NodesOfLazAgree) {
  const auto read = [](std::size_t points, double step) {
    const TempFolder folder;
    EptParts parts = small_parts();
    parts.metadata["dataType"] = "laszip";
    parts.metadata["srs"] = Json::object();
    const std::string file = parts.write(folder.path());
    PointHeader header{.attributes = {{.name = "intensity", .type = ScalarType::u16}}};
    header.crs.wkt = "LOCAL_CS[\"made\"]";
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
  EXPECT_NE(read(2, 1).find("counts 3 points, the file has 2"), std::string::npos);
  EXPECT_NE(read(3, 0.5).find("scale or offset"), std::string::npos);
}

/// A copy of the data set whose nodes hold records of its schema.
std::string write_by_schema(const fs::path& from, const fs::path& folder, bool zstandard) {
  Json metadata = Json::parse(read_text(from / "ept.json"));
  metadata["dataType"] = zstandard ? "zstandard" : "binary";
  fs::create_directories(folder / "ept-data");
  fs::copy(from / "ept-hierarchy", folder / "ept-hierarchy");
  for (const auto& entry : fs::directory_iterator(from / "ept-data")) {
    const AllPoints node = read_file(entry.path());
    // The headers' offsets are not those of the schema.
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

TEST(Ept, LoneStarInAllThreeForms) {
  const char* const data = std::getenv("TERRACE_DATA");
  if (data == nullptr) GTEST_SKIP() << "no TERRACE_DATA";
  const fs::path folder = fs::path(data) / "lidar" / "ept-lone-star";
  const AllPoints all = read_file(folder);
  EXPECT_EQ(all.info.points, 518862u);
  EXPECT_EQ(all.info.octree->nodes, 13u);
  EXPECT_EQ(all.info.octree->depths, 4u);
  EXPECT_EQ(all.info.octree->spacing, 44.0 / 128);
  EXPECT_NE(all.info.crs.wkt.find("NAD83 / UTM zone 12N"), std::string::npos);
  // The nodes are LAZ files: read as such they are the same.
  std::vector<std::string> nodes;
  for (const auto& entry : fs::directory_iterator(folder / "ept-data")) {
    nodes.push_back(entry.path().string());
  }
  EXPECT_TRUE(records(all) == records(read_all(nodes)));
  expect_parts_of_regions({(folder / "ept.json").string()}, all);
  expect_coarser_parts((folder / "ept.json").string());

  const auto values_of = [](const AllPoints& points, std::initializer_list<const char*> names) {
    std::vector<std::vector<double>> found;
    std::vector<std::pair<ScalarType, std::size_t>> columns;
    for (const char* const name : names) {
      const auto& attributes = points.info.attributes;
      const auto channel = std::find_if(attributes.begin(), attributes.end(),
                                        [&](const Channel& c) { return c.name == name; });
      EXPECT_NE(channel, attributes.end()) << name;
      if (channel == attributes.end()) return found;
      const auto number = static_cast<std::size_t>(channel - attributes.begin());
      columns.emplace_back(channel->type, points.info.attribute_offset(number));
    }
    const std::size_t bytes = points.info.payload_size();
    for (std::size_t i = 0; i < points.points.size(); ++i) {
      const Point3 at = world_point(points.info, points.points.positions[i]);
      // In steps, as offsets differ.
      std::vector<double> values;
      for (const double value : at) values.push_back(std::round(value / 0.00025));
      for (const auto& [type, offset] : columns) {
        values.push_back(to_double(type, points.points.payload.data() + i * bytes + offset));
      }
      found.push_back(values);
    }
    std::sort(found.begin(), found.end());
    return found;
  };
  const auto shared = {"intensity", "return_number", "classification", "gps_time"};
  EXPECT_TRUE(values_of(all, shared) ==
              values_of(read_file(folder.parent_path() / "lone-star.copc.laz"), shared));

  const auto most = {"intensity",         "return_number",
                     "number_of_returns", "scan_direction_flag",
                     "classification",    "edge_of_flight_line",
                     "user_data",         "point_source_id",
                     "gps_time",          "OriginId"};
  const TempFolder made;
  for (const bool zstandard : {false, true}) {
    const std::string file =
        write_by_schema(folder, made.path() / (zstandard ? "zst" : "bin"), zstandard);
    const AllPoints other = read_file(file, {.threads = 2});
    EXPECT_EQ(other.info.attributes.size(), 11u);
    EXPECT_TRUE(values_of(other, most) == values_of(all, most));
    EXPECT_TRUE(other.points.payload == read_file(file).points.payload);
  }
}

}  // namespace
}  // namespace terrace::stream
