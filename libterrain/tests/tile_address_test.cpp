// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <terrace/base/random.hpp>

#include "tile/format/address.hpp"

namespace terrace::terrain {
namespace {

TEST(TileAddress, PathsReadBack) {
  const TileAddress tile{12, 4323, 2345};
  EXPECT_EQ(tile_path(tile), "12/4323/2345.terrain");
  EXPECT_EQ(parse_tile_path("12/4323/2345.terrain"), tile);
  EXPECT_EQ(parse_tile_path("0/1/0.terrain"), (TileAddress{0, 1, 0}));
  for (const char* path : {"", "0/0/0", "0/2/0.terrain", "0/0/1.terrain", "1/00/0.terrain",
                           "1/-1/0.terrain", "31/0/0.terrain", "a/0/0.terrain", "1/1/1.terrain.gz",
                           "99999999999/0/0.terrain", "1//1.terrain"}) {
    EXPECT_EQ(parse_tile_path(path), std::nullopt) << path;
  }
}

TEST(TileAddress, NeighboursShareTheirBorders) {
  for (unsigned zoom = 0; zoom <= kDeepestZoom; ++zoom) {
    const std::uint32_t x = tile_columns(zoom) / 3, y = tile_rows(zoom) / 3;
    const GeographicBox tile = box_of({zoom, x, y});
    EXPECT_EQ(tile.east, box_of({zoom, x + 1, y}).west);
    if (zoom > 0) {
      EXPECT_EQ(tile.north, box_of({zoom, x, y + 1}).south);
      EXPECT_EQ(box_of({zoom - 1, x / 2, y / 2}).west, box_of({zoom, x / 2 * 2, y}).west);
    }
  }
  EXPECT_EQ(box_of({0, 1, 0}).east, 180.0);
  EXPECT_EQ(box_of({5, 63, 31}).north, 90.0);
}

TEST(TileAddress, RangesContainTilesThatMeetABox) {
  std::uint64_t seed = 7;
  const auto random = [&](double low, double high) {
    seed = base::splitmix64(seed);
    return low + (high - low) * base::unit_interval(seed);
  };
  for (int round = 0; round < 200; ++round) {
    SCOPED_TRACE(round);
    const auto zoom = static_cast<unsigned>(round % 6);
    GeographicBox box{random(-180, 180), random(-90, 90), 0, 0};
    box.east = random(box.west, 180);
    box.north = random(box.south, 90);
    if (round % 3 == 0) box.west = box_of({zoom, tile_columns(zoom) / 2, 0}).west;
    if (box.east < box.west) box.east = box.west + 1;
    const TileRange range = tiles_in(box, zoom);
    for (std::uint32_t y = 0; y < tile_rows(zoom); ++y) {
      for (std::uint32_t x = 0; x < tile_columns(zoom); ++x) {
        const GeographicBox tile = box_of({zoom, x, y});
        const bool meets = tile.west < box.east && box.west < tile.east && tile.south < box.north &&
                           box.south < tile.north;
        const bool inside = x >= range.x0 && x <= range.x1 && y >= range.y0 && y <= range.y1;
        EXPECT_EQ(meets, inside) << zoom << '/' << x << '/' << y;
      }
    }
  }
}

TEST(TileAddress, BoxWithoutWidthHasATile) {
  const TileRange range = tiles_in({180, 90, 180, 90}, 3);
  EXPECT_EQ(range, (TileRange{15, 7, 15, 7}));
}

TEST(TileAddress, ExpectedErrorHalvesWithEachZoom) {
  EXPECT_NEAR(expected_error(0), 77067.34, 0.01);
  EXPECT_EQ(expected_error(12), expected_error(0) / 4096);
}

}  // namespace
}  // namespace terrace::terrain
