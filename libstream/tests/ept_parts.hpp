// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>
#include <zstd.h>

#include "point_files.hpp"

namespace terrace::stream {

using Json = nlohmann::json;

inline std::string compressed(std::string_view bytes) {
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3));
  return out;
}

/// A data set of 8 x 8 x 8 units with its corner at 0 and records written by the test itself.
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
        {{"name", "Custom value"}, {"type", "float"}, {"size", 8}}}}};
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
  std::string write(const std::filesystem::path& folder) const {
    std::filesystem::create_directories(folder / "ept-data");
    std::filesystem::create_directories(folder / "ept-hierarchy");
    for (const auto& [name, text] : hierarchy) {
      write_text(folder / "ept-hierarchy" / (name + ".json"), text);
    }
    for (const auto& [name, bytes] : nodes) write_text(folder / "ept-data" / name, bytes);
    return write_text(folder / "ept.json", metadata.dump());
  }
};

/// Three nodes; the last is described by a separate file of the hierarchy.
inline EptParts small_parts() {
  EptParts parts;
  parts.add("0-0-0-0.bin", {{-8, -8, 0}, {7, 7, 31}});
  parts.add("1-0-0-0.bin", {{-7, -7, 1}, {-6, -7, 2}, {-5, -5, 3}});
  parts.add("2-3-0-0.bin", {{4, -8, 4}});
  parts.hierarchy["0-0-0-0"] = R"({"0-0-0-0": 2, "1-0-0-0": 3, "1-1-0-0": 0, "2-3-0-0": -1})";
  parts.hierarchy["2-3-0-0"] = R"({"2-3-0-0": 1})";
  return parts;
}

}  // namespace terrace::stream
