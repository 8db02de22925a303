// SPDX-License-Identifier: Apache-2.0
// Checks the statements of FORMAT.md about the manifest one by one: a store that violates one of
// them, with good checksums, is refused when it is opened or read, or reported by verify.
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "store_invariants_testing.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {
namespace {

using nlohmann::ordered_json;
using testing::StoreFiles;

struct ManifestCase {
  const char* expected;
  std::function<void(ordered_json&)> edit;
};

/// Returns the segment of level 0, with separate bounds.
ordered_json& segment_of(ordered_json& manifest) {
  ordered_json& segment = manifest["levels"][0]["segments"][0];
  if (!segment.contains("bounds")) segment["bounds"] = manifest["bounds"];
  return segment;
}

TEST(StoreInvariants, RefusesManifestsWithInvalidCounts) {
  const auto level = [](ordered_json& m, std::size_t l) -> ordered_json& { return m["levels"][l]; };
  const std::vector<ManifestCase> cases{
      {"the points of level 0", [](auto& m) { m["points"] = 1; }},
      {"a count is not an unsigned", [](auto& m) { m["points"] = -1; }},
      {"a count is not an unsigned", [](auto& m) { m["points"] = 2500.5; }},
      {"a count is not an unsigned", [](auto& m) { m["nodata"] = 1e30; }},
      {"more points than possible", [](auto& m) { m["nodata"] = std::uint64_t{1} << 60; }},
      {"the number of levels", [](auto& m) { m["levels"] = ordered_json::array(); }},
      {"the levels are not numbered", [&](auto& m) { level(m, 1)["level"] = 2; }},
      {"the members of level 0", [&](auto& m) { level(m, 0)["members"] = 5; }},
      {"the members of level 0", [&](auto& m) { level(m, 1)["points"] = 100000; }},
      {"do not have the level's clusters", [&](auto& m) { level(m, 0)["clusters"] = 5; }},
      {"the clusters of level 0",
       [&](auto& m) {
         level(m, 0)["clusters"] = 5;
         level(m, 0)["segments"][0]["clusters"] = 5;
       }},
      {"do not have the level's clusters",
       [&](auto& m) { level(m, 0)["segments"].push_back(level(m, 0)["segments"][0]); }},
      {"do not have the level's clusters",
       [&](auto& m) { level(m, 0)["segments"] = ordered_json::array(); }},
      {"do not have the level's clusters",
       [&](auto& m) {
         level(m, 0)["segments"].push_back(level(m, 0)["segments"][0]);
         level(m, 0)["segments"][1]["clusters"] = 0;
       }},
      {"does not have a base",
       [&](auto& m) {
         level(m, 1)["segments"][0]["base"] = {0, 0};
       }},
      {"an impossible base",
       [&](auto& m) {
         level(m, 1)["segments"][0]["base"] = {
             level(m, 0)["clusters"].template get<std::uint64_t>() + 1};
       }},
      // A number of clusters that is only possible if products wrap.
      {"more clusters than its index",
       [&](auto& m) {
         const std::uint64_t count = std::numeric_limits<std::uint64_t>::max();
         m["points"] = level(m, 0)["points"] = count;
         level(m, 1)["points"] = level(m, 0)["clusters"] = count;
         level(m, 0)["segments"][0]["clusters"] = count;
         level(m, 0)["members"] = 0;
       }},
      {"more clusters than its index",
       [&](auto& m) {
         const std::uint64_t count = std::uint64_t{1} << 40;
         m["points"] = level(m, 0)["points"] = 2 * count;
         level(m, 1)["points"] = level(m, 0)["clusters"] = count;
         level(m, 0)["segments"][0]["clusters"] = count;
         level(m, 0)["members"] = count;
       }},
      {"more points than its clusters",
       [&](auto& m) {
         const std::uint64_t clusters = level(m, 0)["clusters"];
         m["points"] = level(m, 0)["points"] = std::uint64_t{1} << 40;
         level(m, 0)["members"] = (std::uint64_t{1} << 40) - clusters;
       }},
      {"a store without points has clusters",
       [&](auto& m) {
         m["points"] = 0;
         m["bounds"] = nullptr;
         for (auto& l : m["levels"]) l["points"] = l["members"] = 0;
       }},
      {"a file name is not allowed",
       [&](auto& m) { level(m, 0)["segments"][0]["data"]["file"] = "../x"; }},
      {"a file name is not allowed",
       [&](auto& m) { level(m, 0)["segments"][0]["data"]["file"] = ".x"; }},
      {"smaller than its directory",
       [&](auto& m) { level(m, 0)["segments"][0]["directory_bytes"] = std::uint64_t{1} << 62; }},
  };
  for (const ManifestCase& c : cases) {
    StoreFiles files = testing::grid_files();
    testing::edit_manifest(files, c.edit);
    testing::expect_refused(files, c.expected);
  }
}

TEST(StoreInvariants, RefusesManifestsWithInvalidPlaces) {
  const std::vector<ManifestCase> cases{
      {"the bounds are missing or empty", [](auto& m) { m["bounds"] = nullptr; }},
      {"the bounds are missing or empty", [](auto& m) { m["bounds"]["min"][2] = "nan"; }},
      {"the bounds are missing or empty", [](auto& m) { m["bounds"]["min"][2] = 1e9; }},
      {"the bounds are not finite", [](auto& m) { m["bounds"]["max"][2] = "inf"; }},
      {"not finite in the CRS", [](auto& m) { m["coordinates"][2]["scale"] = 1e308; }},
      {"on the raster's columns", [](auto& m) { m["columns"] = 20; }},
      {"on the raster's columns", [](auto& m) { m["rows"] = 49; }},
      {"on the raster's columns", [](auto& m) { m["bounds"]["min"][0] = -1; }},
      {"on the raster's columns", [](auto& m) { m["bounds"]["max"][1] = 48.5; }},
      {"number of columns", [](auto& m) { m["columns"] = 0; }},
      {"number of columns", [](auto& m) { m["rows"] = std::uint64_t{1} << 32; }},
      {"a cloud has columns", [](auto& m) { m["kind"] = "cloud"; }},
      {"scale or offset", [](auto& m) { m["coordinates"][2]["scale"] = 0; }},
      {"scale or offset", [](auto& m) { m["coordinates"][2]["scale"] = "nan"; }},
      {"scale or offset", [](auto& m) { m["coordinates"][0]["offset"] = "-inf"; }},
      {"the world transform", [](auto& m) { m["world"][0] = 0; }},
      {"the world transform", [](auto& m) { m["world"][5] = "nan"; }},
      {"an EPSG code", [](auto& m) { m["crs"]["epsg"] = std::uint64_t{1} << 31; }},
      {"a count", [](auto& m) { m["crs"]["epsg"] = 1e300; }},
      {"a count", [](auto& m) { m["crs"]["vertical_epsg"] = -5; }},
      {"an unknown type", [](auto& m) { m["coordinates"][0]["type"] = "int3"; }},
      {"exceeds the bounds", [](auto& m) { segment_of(m)["bounds"]["max"][2] = 1e9; }},
      {"exceeds the bounds", [](auto& m) { segment_of(m)["bounds"]["min"][0] = "nan"; }},
      {"exceeds the bounds",
       [](auto& m) {
         segment_of(m)["shift"] = {1, 0, 0};
       }},
      {"an impossible shift",
       [](auto& m) {
         segment_of(m)["shift"] = {0, 0.5, 0};
       }},
      {"an impossible shift",
       [](auto& m) {
         segment_of(m)["shift"] = {0, 0, 1e300};
       }},
      {"three numbers",
       [](auto& m) {
         segment_of(m)["shift"] = {0, 0};
       }},
  };
  for (const ManifestCase& c : cases) {
    StoreFiles files = testing::grid_files();
    testing::edit_manifest(files, c.edit);
    testing::expect_refused(files, c.expected);
  }
}

TEST(StoreInvariants, ChecksTheChildrenOfSegmentsWithABase) {
  StoreFiles files = testing::grid_files();
  testing::edit_manifest(files,
                         [](ordered_json& m) { m["levels"][1]["segments"][0]["base"] = {1}; });
  testing::expect_unreadable(files, "heads a cluster that does not exist");
}

TEST(StoreInvariants, RefusesManifestsWithUnknownWords) {
  const auto parameter = [](ordered_json& m, const char* value) {
    m["parameters"].push_back({{"name", "entities"}, {"value", value}});
  };
  const std::vector<ManifestCase> cases{
      {"the kind is unknown", [](auto& m) { m["kind"] = "<b>grid</b>"; }},
      {"unknown type", [](auto& m) { m["coordinates"][2]["type"] = "int24"; }},
      {"the kind of heights", [](auto& m) { m["vertical"] = "<b>ellipsoidal</b>"; }},
      {"the entities are unknown", [&](auto& m) { parameter(m, "<img src=x onerror=alert(1)>"); }},
      {"the entities are unknown", [&](auto& m) { parameter(m, "triangle"); }},
      {"the entities are unknown", [&](auto& m) { parameter(m, ""); }},
  };
  for (const ManifestCase& c : cases) {
    SCOPED_TRACE(c.expected);
    StoreFiles files = testing::cloud_files();
    testing::edit_manifest(files, c.edit);
    testing::expect_refused(files, c.expected);
  }
  for (const Entities entities :
       {Entities::points, Entities::triangles, Entities::segments, Entities::polylines}) {
    StoreFiles files = testing::cloud_files();
    testing::edit_manifest(
        files, [&](ordered_json& m) { parameter(m, std::string(name_of(entities)).c_str()); });
    const TempFolder folder;
    testing::write_files(folder.path(), files);
    EXPECT_EQ(testing::error_of_opening(folder.path()), "") << name_of(entities);
  }
}

TEST(StoreInvariants, VerifyFindsManifestsWithWrongKeysOrSummaries) {
  const char* const order = "keys or their order are wrong";
  const std::vector<ManifestCase> cases{
      {order,
       [](auto& m) {
         ordered_json other{{"more", 1}};
         other.update(m);
         m = other;
       }},
      {order, [](auto& m) { m["levels"][0]["more"] = 1; }},
      {order,
       [](auto& m) {
         ordered_json other{{"kind", m["kind"]}};
         other.update(m);
         m = other;
       }},
      {order, [](auto& m) { m["coordinates"][0]["type"] = "int"; }},  // PLY's name of int32
      {"the bounds are not those of the points", [](auto& m) { m["bounds"]["min"][2] = -1e6; }},
      {"the mean height", [](auto& m) { m["mean_height"] = 0; }},
      {"the mean height", [](auto& m) { m["mean_height"] = "nan"; }},
  };
  for (const ManifestCase& c : cases) {
    StoreFiles files = testing::grid_files();
    testing::edit_manifest(files, c.edit);
    testing::expect_problem(files, c.expected);
  }
  // update_checksums() recomputes these, so they are changed as text.
  StoreFiles files = testing::grid_files();
  std::string& text = files["manifest.json"];
  const std::size_t at = text.find("\"crc32\": \"") + 10;
  std::transform(text.begin() + static_cast<std::ptrdiff_t>(at),
                 text.begin() + static_cast<std::ptrdiff_t>(at + 8),
                 text.begin() + static_cast<std::ptrdiff_t>(at),
                 [](char c) { return static_cast<char>(std::toupper(c)); });
  ASSERT_NE(text, testing::grid_files().at("manifest.json"));
  text.replace(text.size() - 12, 8, "00000000");
  const std::string checksum = store::hexadecimal(testing::crc32_of(text, 0, text.size()));
  text.replace(text.size() - 12, 8, checksum);
  testing::expect_problem(files, order);
}

}  // namespace
}  // namespace terrace::stream
