// SPDX-License-Identifier: Apache-2.0
#include "earth/region_crs.hpp"

#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

const stream::Box3 kEverywhere{{-1e8, -1e8, -1e8}, {1e8, 1e8, 1e8}};

// Oracle: the point itself, converted back to the region's system.
TEST(RegionCrs, ContainsSamePointsAsBox) {
  struct Case {
    const char *from, *to;
    const char* box;
  };
  const Case cases[] = {
      {"EPSG:4326", "EPSG:32632", "8,46,12,48"},
      {"EPSG:4326", "EPSG:3035", "-10,35,30,70"},
      {"EPSG:4326", "EPSG:3413", "-180,60,180,90"},
      {"EPSG:32632", "EPSG:4326", "200000,5000000,800000,6000000"},
      {"EPSG:3857", "EPSG:32633", "1500000,6000000,1800000,6300000"},
      {"EPSG:4326", "EPSG:32660", "179,-5,181,10"},
      {"EPSG:32660", "EPSG:4326", "600000,0,900000,1000000"},
  };
  for (const Case& test : cases) {
    SCOPED_TRACE(std::string(test.from) + " to " + test.to);
    const CoordinateSystem from = CoordinateSystem::parse(test.from);
    const CoordinateSystem to = CoordinateSystem::parse(test.to);
    const Region box = Region::parse(test.box);
    const stream::Box3 world =
        to.is_geographic() ? stream::Box3{{-180, -90, 0}, {180, 90, 0}} : kEverywhere;
    const Region region = region_in(box, Transformation(to, from), world);
    const Transformation change(from, to);
    std::mt19937_64 random(7);
    const auto unit = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    for (int i = 0; i < 2000; ++i) {
      // Test places in a box half again as large, in its own system. Skip those closer to the
      // border than a thousandth of its size, where the polygon may differ.
      const double width = box.box().max[0] - box.box().min[0];
      const double height = box.box().max[1] - box.box().min[1];
      const double u = 1.4 * unit() - 0.2, v = 1.4 * unit() - 0.2;
      if (std::min({std::abs(u), std::abs(1 - u), std::abs(v), std::abs(1 - v)}) < 1e-3) continue;
      Point2 place{box.box().min[0] + u * width, box.box().min[1] + v * height};
      if (from.is_geographic() && (std::abs(place[1]) > 89.9 || width == 360)) {
        if (u < 0 || u > 1 || std::abs(place[1]) > 89.9) continue;
      }
      const bool inside = u > 0 && u < 1 && v > 0 && v < 1;
      change.forward({&place, 1});
      EXPECT_EQ(region.contains({place[0], place[1], 0}), inside) << u << ' ' << v;
    }
  }
}

TEST(RegionCrs, KeepsHeights) {
  const Region box = Region::parse("8,46,100,9,47,200");
  const Region region = region_in(
      box,
      Transformation(CoordinateSystem::parse("EPSG:32632"), CoordinateSystem::parse("EPSG:4326")),
      kEverywhere);
  EXPECT_EQ(region.box().min[2], 100);
  EXPECT_EQ(region.box().max[2], 200);
}

TEST(RegionCrs, RejectsOutlinesBeyondTheCrs) {
  const CoordinateSystem degrees, mercator = CoordinateSystem::parse("EPSG:3857");
  EXPECT_THROW(
      region_in(Region::parse("0,0,10,90"), Transformation(mercator, degrees), kEverywhere),
      stream::Error);
  EXPECT_THROW(
      region_in(Region::parse("0,0,10,95"), Transformation(mercator, degrees), kEverywhere),
      stream::Error);
  // The projection cuts it in two: one side of the antimeridian is on the left, one on the right.
  EXPECT_THROW(
      region_in(Region::parse("170,0,190,10"),
                Transformation(CoordinateSystem::parse("EPSG:8857"), degrees), kEverywhere),
      stream::Error);
  EXPECT_THROW(
      region_in(Region::parse("-1000000,-1000000,900000,900000"),
                Transformation(degrees, CoordinateSystem::parse("EPSG:3413")), kEverywhere),
      stream::Error);
}

TEST(RegionCrs, MercatorContinuesAtItsEdges) {
  const CoordinateSystem degrees, mercator = CoordinateSystem::parse("EPSG:3857");
  const Region region =
      region_in(Region::parse("170,0,190,10"), Transformation(mercator, degrees), kEverywhere);
  for (const double x : {19e6, 20037000.0, -20037000.0, -19e6, 20038000.0}) {
    EXPECT_TRUE(region.covers({x, 5e5})) << x;
  }
  EXPECT_FALSE(region.covers({0, 5e5}));
  EXPECT_FALSE(region.covers({-18.9e6, 5e5}));
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const stream::Box3 kAlps{{8, 46, 0}, {9, 47, 0}};

TEST(RegionCrs, ShiftedBoxIsABox) {
  for (const char* const text : {"8.3,46,8.5,47", "-351.7,46,-351.5,47", "368.3,46,368.5,47"}) {
    const Region region = with_turns(Region::parse(text), 360, kAlps, {1e-9, 1e-9});
    EXPECT_TRUE(region.polygons().empty()) << text;
    for (const double x : {8.3, 8.5}) EXPECT_TRUE(region.covers({x, 46})) << text;
    for (const double x : {8.2999, 8.5001}) EXPECT_FALSE(region.covers({x, 46})) << text;
    EXPECT_NEAR(region.extent().min[0], 8.3, 1e-12) << text;
  }
  // Without rounding there is nothing to add; with it, the box is wider than its extent.
  EXPECT_EQ(with_turns(Region::parse("8.3,46,8.5,47"), 360, kAlps).box().min[0], 8.3);
  EXPECT_LT(with_turns(Region::parse("8.3,46,8.5,47"), 360, kAlps, {1e-9, 0}).box().min[0], 8.3);
}

TEST(RegionCrs, BoxHasPartAtEachEndOfData) {
  const stream::Box3 world{{0, -90, 0}, {359, 90, 0}};
  const Region region = with_turns(Region::of_box({{-10, -kInfinity, 0}, {10, kInfinity, 0}}), 360,
                                   world, {1e-6, 1e-6});
  EXPECT_EQ(region.polygons().size(), 2U);
  for (const double x : {0.0, 10.0, 350.0, 359.0}) EXPECT_TRUE(region.covers({x, 90})) << x;
  for (const double x : {10.01, 180.0, 349.99}) EXPECT_FALSE(region.covers({x, 90})) << x;
  EXPECT_TRUE(with_turns(Region::parse("-180,-90,180,90"), 360, world).polygons().empty());
  EXPECT_TRUE(with_turns(Region::parse("-180,-90,180,90"), 360, world).covers({270, 0}));
}

TEST(RegionCrs, JoinsPolygonsAcrossAntimeridian) {
  const stream::Box3 fiji{{179, -18, 0}, {181, -16, 0}};
  const auto square = [](double west) {
    return Polygon{{{west, -17}, {west + 0.5, -17}, {west + 0.5, -16}, {west, -16}}};
  };
  for (const double away : {0.0, 360.0}) {
    const Region region =
        with_turns(Region::of_polygons({square(179.5 + away), square(-180)}, 0, 0), 360, fiji);
    EXPECT_EQ(region.box().min[0], 179.5);
    EXPECT_EQ(region.box().max[0], 180.5);
    for (const double x : {179.5, 180.0, 180.5}) EXPECT_TRUE(region.covers({x, -16.5})) << x;
  }
}

TEST(RegionCrs, InfiniteBoxIsUnchanged) {
  const Region west = Region::of_box({{-kInfinity, -kInfinity, 0}, {8.5, kInfinity, 0}});
  EXPECT_TRUE(with_turns(west, 360, kAlps).covers({8.5, 46}));
  EXPECT_FALSE(with_turns(west, 360, kAlps).covers({8.6, 46}));
}

}  // namespace
}  // namespace terrace::terrain
