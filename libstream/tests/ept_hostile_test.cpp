// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <map>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "ept_parts.hpp"
#include "point_files.hpp"

namespace terrace::stream {
namespace {

TEST(Ept, RejectsInvalidDataSets) {
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
  EXPECT_PRED2(has, with_dimension(1, {{"name", "Y"}}), "repeats Y");
  EXPECT_PRED2(has, with_dimension(4, {{"name", "Intensity"}}), "repeats Intensity");
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
  // Time is linear in their number.
  EXPECT_EQ(with("more", Json(400'000, Json::object())), "");
  EXPECT_PRED2(has, with("more", Json(600'000, Json::object())), "has too many values");
  Json dimensions = Json::array();
  for (int i = 0; i < 5000; ++i) {
    dimensions.push_back({{"name", std::to_string(i)}, {"type", "unsigned"}, {"size", 1}});
  }
  EXPECT_PRED2(has, with("schema", dimensions), "has too many dimensions");
  {
    const TempFolder folder;
    const std::string file = small_parts().write(folder.path());
    write_text(file, "{\"bounds\": ");
    EXPECT_PRED2(has, error_of([&] { read_file(file); }), "not JSON");
    write_text(file, "");
    EXPECT_PRED2(has, error_of([&] { read_file(file); }), "ept.json");
    write_text(file, "{\"points\": 1e999}");
    EXPECT_PRED2(has, error_of([&] { read_file(file); }), "too large for a double");
    write_text(file, "[1, 2, 3]");
    EXPECT_PRED2(has, error_of([&] { read_file(file); }), "object");
  }
  // The hierarchy.
  const auto with_root = [&](const std::string& text) {
    return refusal([&](EptParts& parts) { parts.hierarchy["0-0-0-0"] = text; });
  };
  EXPECT_PRED2(has, with_root(R"({"0-0-0-0": 2, "0-0-0-0": 3, "2-3-0-0": -1})"), "is listed twice");
  EXPECT_PRED2(has, with_root(R"({"0-0-0-0": -1})"), "referred to twice");
  EXPECT_PRED2(has, with_root(R"({"2-3-0-0": -1, "02-3-0-0": -1})"), "referred to twice");
  EXPECT_PRED2(has, with_root(R"({"0-0-0-0": -2})"), "has -2 points");
  EXPECT_PRED2(has, with_root(R"({"0-0-0-0": 1.5})"), "point counts");
  EXPECT_PRED2(has, with_root(R"({"0-0-0-0": 18446744073709551615})"), "more points");
  EXPECT_PRED2(has, with_root(R"({"0-0-0-0": {}})"), "point counts");
  EXPECT_PRED2(has, with_root("[1]"), "point counts");
  EXPECT_PRED2(has, with_root("1"), "point counts");
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
               "ends earlier");
  EXPECT_PRED2(has, with_zstd([](std::string& node, const std::string&) { node.pop_back(); }),
               "is truncated");
  EXPECT_PRED2(has, with_zstd([](std::string& node, const std::string&) { node.clear(); }),
               "ends earlier");
  EXPECT_PRED2(has, with_zstd([](std::string& node, const std::string&) { node[0] ^= 1; }),
               "zstandard: ");
  EXPECT_PRED2(has, with("dataType", "laszip"), "0-0-0-0.laz");
}

}  // namespace
}  // namespace terrace::stream
