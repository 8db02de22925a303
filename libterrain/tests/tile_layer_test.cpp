// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <terrace/base/random.hpp>
#include <terrace/stream/error.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/tile_check.hpp"
#include "tile/format/layer.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

class TileLayerFile : public ::testing::Test {
 protected:
  void write(const std::string& text) const { std::ofstream(path_) << text; }

  tests::TemporaryFolder scratch_;
  fs::path path_ = scratch_.path() / "layer.json";
};

TEST(TileRanges, CoverExactlyTheTiles) {
  std::uint64_t seed = 1;
  for (int round = 0; round < 100; ++round) {
    SCOPED_TRACE(round);
    std::vector<TileAddress> tiles;
    for (std::uint32_t y = 0; y < 16; ++y) {
      for (std::uint32_t x = 0; x < 32; ++x) {
        seed = base::splitmix64(seed);
        if (base::unit_interval(seed) < round / 100.0) tiles.push_back({4, x, y});
      }
    }
    std::vector<TileAddress> covered;
    for (const TileRange& range : ranges_of(tiles)) {
      for (std::uint32_t y = range.y0; y <= range.y1; ++y) {
        for (std::uint32_t x = range.x0; x <= range.x1; ++x) covered.push_back({4, x, y});
      }
    }
    std::sort(covered.begin(), covered.end(), [](const TileAddress& a, const TileAddress& b) {
      return a.y != b.y ? a.y < b.y : a.x < b.x;
    });
    EXPECT_EQ(covered, tiles);
  }
}

TEST(TileRanges, RectangleIsOneRange) {
  std::vector<TileAddress> tiles;
  for (std::uint32_t y = 3; y < 9; ++y) {
    for (std::uint32_t x = 5; x < 20; ++x) tiles.push_back({4, x, y});
  }
  EXPECT_EQ(ranges_of(tiles), (std::vector<TileRange>{{5, 3, 19, 8}}));
}

TEST_F(TileLayerFile, ReadsBack) {
  TileLayer layer;
  layer.name = "dem";
  layer.bounds = {10, 45, 11.7, 46.7};
  layer.last_zoom = 1;
  layer.extensions = {"octvertexnormals"};
  layer.available = {{{0, 0, 1, 0}}, {{2, 1, 2, 1}}};
  layer.max_errors = {100, 50};
  layer.fingerprint = "abc";
  write(layer_json(layer));
  const TileLayer back = read_layer(path_);
  EXPECT_EQ(back.name, layer.name);
  EXPECT_EQ(back.bounds.east, 11.7);
  EXPECT_EQ(back.last_zoom, 1U);
  EXPECT_EQ(back.extensions, layer.extensions);
  EXPECT_EQ(back.available, layer.available);
  EXPECT_EQ(back.max_errors, layer.max_errors);
  EXPECT_EQ(back.fingerprint, "abc");
}

TEST(TileLayerText, DeclaresMetadataAvailability) {
  TileLayer layer;
  layer.available = {{{0, 0, 1, 0}}};
  EXPECT_FALSE(nlohmann::json::parse(layer_json(layer)).contains("metadataAvailability"));
  layer.extensions = {"metadata"};
  EXPECT_EQ(nlohmann::json::parse(layer_json(layer)).at("metadataAvailability"), 1);
}

TEST_F(TileLayerFile, RejectsInvalidTileSets) {
  EXPECT_THROW(read_layer(path_), stream::Error);  // no file
  TileLayer layer;
  layer.available = {{{0, 0, 1, 0}}};
  const nlohmann::json good = nlohmann::json::parse(layer_json(layer));
  write(good.dump());
  EXPECT_NO_THROW(read_layer(path_));
  const auto refuse = [&](const char* key, const nlohmann::json& value) {
    nlohmann::json bad = good;
    bad[key] = value;
    write(bad.dump());
    EXPECT_THROW(read_layer(path_), stream::Error) << key << " " << value;
  };
  refuse("format", "heightmap-1.0");
  refuse("scheme", "slippyMap");
  refuse("projection", "EPSG:3857");
  refuse("bounds", {1, 2, 3});
  refuse("available", 3);
  refuse("available", nlohmann::json::array());
  refuse("available", {{{{"startX", 0}, {"startY", 0}, {"endX", 2}, {"endY", 0}}}});
  refuse("available", {{{{"startX", 1}, {"startY", 0}, {"endX", 0}, {"endY", 0}}}});
  write("{");
  EXPECT_THROW(read_layer(path_), stream::Error);
}

TEST_F(TileLayerFile, RejectsInvalidCounts) {
  TileLayer layer;
  layer.available = {{{0, 0, 1, 0}}, {{0, 0, 3, 1}}};
  const nlohmann::json good = nlohmann::json::parse(layer_json(layer));
  for (const nlohmann::json& number :
       {nlohmann::json(-1), nlohmann::json(0.5), nlohmann::json(1e300), nlohmann::json("1"),
        nlohmann::json(std::uint64_t{1} << 32)}) {
    nlohmann::json bad = good;
    bad["available"][1][0]["startX"] = number;
    write(bad.dump());
    EXPECT_THROW(read_layer(path_), stream::Error) << number;
    bad = good;
    bad["minzoom"] = number;
    write(bad.dump());
    EXPECT_THROW(read_layer(path_), stream::Error) << number;
  }
}

TEST_F(TileLayerFile, FolderWithoutTilesIsNotAnUnfinishedSet) {
  for (const fs::path& folder : {scratch_.path(), scratch_.path() / "none"}) {
    try {
      check_tiles({.folder = folder});
      ADD_FAILURE() << "no error for " << folder;
    } catch (const stream::Error& error) {
      EXPECT_EQ(error.parts().cause.text(), "contains no tile set");
    }
  }
}

}  // namespace
}  // namespace terrace::terrain
