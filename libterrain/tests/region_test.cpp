// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/region.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include <gtest/gtest.h>

#include "base/polygon.hpp"
#include "base/portable_math.hpp"
#include "temporary_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {

using namespace terrain;
namespace {

/// A file that goes with the object.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text) { std::ofstream(path_) << text; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  tests::TemporaryFolder scratch_;
  std::string path_ = scratch_.path() / "region.geojson";
};

Region region_of(const std::string& geojson) {
  return Region::parse(TemporaryFile(geojson).path());
}

TEST(Region, BoxesAreClosedAndMayBeNegative) {
  const Region flat = Region::parse("-10,-5.5,-2,1e2");
  EXPECT_TRUE(flat.contains({-10, 100, 1e9}));
  EXPECT_TRUE(flat.contains({-2, -5.5, -1e9}));
  EXPECT_FALSE(flat.contains({std::nextafter(-2.0, 0.0), 0, 0}));
  const Region solid = Region::parse("0,0,-1,10,10,1");
  EXPECT_TRUE(solid.contains({0, 10, 1}));
  EXPECT_FALSE(solid.contains({5, 5, 1.1}));
}

TEST(Region, RefusesWhatIsNoBox) {
  for (const char* text : {"1,2,3", "1,2,3,4,5", "5,0,1,1", "0,0,0,1,1,-1", "1,2,,4"}) {
    EXPECT_THROW(Region::parse(text), UsageError) << text;
  }
  EXPECT_THROW(Region::parse("no-such-file.geojson"), stream::Error);
}

TEST(Region, TakesAllKindsOfGeoJson) {
  const std::string square = "[[[0,0],[4,0],[4,4],[0,4],[0,0]],[[1,1],[3,1],[3,3],[1,3],[1,1]]]";
  const std::string polygon = R"({"type":"Polygon","coordinates":)" + square + "}";
  const std::string feature = R"({"type":"Feature","properties":{},"geometry":)" + polygon + "}";
  for (const std::string& json :
       {polygon, feature, R"({"type":"FeatureCollection","features":[)" + feature + "]}",
        R"({"type":"MultiPolygon","coordinates":[)" + square + "]}",
        R"({"type":"GeometryCollection","geometries":[)" + polygon + "]}"}) {
    SCOPED_TRACE(json);
    const Region region = region_of(json);
    EXPECT_EQ(region.box().min[0], 0);
    EXPECT_EQ(region.box().max[1], 4);
    EXPECT_TRUE(region.contains({0.5, 2, 77}));
    EXPECT_FALSE(region.contains({2, 2, 0}));  // in the hole
    EXPECT_TRUE(region.contains({1, 2, 0}));   // on the hole's border
    EXPECT_TRUE(region.contains({4, 4, 0}));   // a corner
    EXPECT_FALSE(region.contains({4.1, 2, 0}));
  }
}

TEST(Region, RefusesHostileGeoJson) {
  std::string deep;
  for (int i = 0; i < 100; ++i) deep += R"({"type":"Feature","geometry":)";
  for (const std::string& json :
       {std::string(), std::string("[]"), std::string("{"), std::string(R"({"type":7})"),
        std::string(R"({"type":"Polygon"})"),
        std::string(R"({"type":"Point","coordinates":[1,2]})"),
        std::string(R"({"type":"Polygon","coordinates":[[[0,0],[1,1]]]})"),
        std::string(R"({"type":"Polygon","coordinates":[[[0,0],[1,"a"],[1,1]]]})"),
        std::string(R"({"type":"Polygon","coordinates":[[[0,0],[1e999,0],[1,1]]]})"),
        std::string(R"({"type":"FeatureCollection","features":[]})"),
        std::string(R"({"type":"FeatureCollection","features":3})"), deep}) {
    EXPECT_THROW(region_of(json), stream::Error) << json;
  }
}

// The typedef form: GCC's __extension__ silences -Wpedantic only before a declaration like this.
__extension__ typedef __int128 Wide;

// Law: the orientation of nearly collinear points is that of their exact integers.
TEST(Orientation, IsExactNearALine) {
  std::mt19937_64 random(7);
  for (int trial = 0; trial < 20000; ++trial) {
    const auto coordinate = [&] {
      return static_cast<std::int64_t>(random() >> 12) - (std::int64_t{1} << 51);
    };
    const std::int64_t ax = coordinate(), ay = coordinate();
    const std::int64_t dx = static_cast<std::int64_t>(random() % 100000), dy = 99991;
    const std::int64_t bx = ax + 3 * dx, by = ay + 3 * dy;
    const std::int64_t cx = ax + 7 * dx + static_cast<std::int64_t>(random() % 3) - 1,
                       cy = ay + 7 * dy;
    const Wide exact = Wide{bx - ax} * (cy - ay) - Wide{by - ay} * (cx - ax);
    const auto d = [](std::int64_t v) { return static_cast<double>(v); };
    EXPECT_EQ(orientation({d(ax), d(ay)}, {d(bx), d(by)}, {d(cx), d(cy)}), exact > 0   ? 1
                                                                           : exact < 0 ? -1
                                                                                       : 0);
  }
}

// Oracle: a convex polygon is an intersection of half planes. Points on a 0..9 grid, so that
// borders and corners are met often.
TEST(Covers, AgreesWithHalfPlanesOfConvexPolygons) {
  std::mt19937_64 random(11);
  int inside = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    SCOPED_TRACE(trial);
    const auto grid = [&] { return static_cast<double>(random() % 10); };
    Point2 a{grid(), grid()}, b{grid(), grid()}, c{grid(), grid()};
    const int turn = orientation(a, b, c);
    if (turn == 0) continue;
    if (turn < 0) std::swap(b, c);
    const Point2 p{grid(), grid()};
    const bool expected =
        orientation(a, b, p) >= 0 && orientation(b, c, p) >= 0 && orientation(c, a, p) >= 0;
    EXPECT_EQ(covers({{a, b, c}}, p), expected);
    EXPECT_EQ(covers({{c, b, a}}, p), expected);  // clockwise rings too
    inside += expected ? 1 : 0;
  }
  EXPECT_GT(inside, 300);
}

}  // namespace
}  // namespace terrace::terrain
