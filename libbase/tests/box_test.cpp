// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/box.hpp>

namespace terrace::base {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Box, DefaultIsEmpty) {
  constexpr Box3 box;
  EXPECT_TRUE(box.empty());
  EXPECT_EQ(box.min, (Point3{kInfinity, kInfinity, kInfinity}));
  EXPECT_FALSE(box.contains(Point3{0, 0, 0}));
  EXPECT_FALSE(box.intersects(Box3{{0, 0, 0}, {1, 1, 1}}));
  EXPECT_EQ(box_of(std::vector<Point3>{}), box);
}

TEST(Box, IncludesItsBorder) {
  constexpr Box2 box{{0, 0}, {2, 1}};
  EXPECT_TRUE(box.contains(Point2{0, 1}));
  EXPECT_FALSE(box.contains(Point2{std::nextafter(2.0, 3.0), 1}));
  EXPECT_TRUE(box.intersects(Box2{{2, 1}, {3, 3}}));
  EXPECT_FALSE(box.intersects(Box2{{2.5, 0}, {3, 3}}));
  EXPECT_TRUE(box.covers(box));
  EXPECT_FALSE(box.covers(Box2{{0, 0}, {2, 1.5}}));
  EXPECT_FALSE(box.empty());
  EXPECT_FALSE((Box2{{1, 1}, {1, 1}}.empty()));
}

TEST(Box, IncludingAnEmptyBoxChangesNothing) {
  Box2 box{{0, 0}, {2, 1}};
  const Box2 before = box;
  box.include(Box2{});
  box.include(Box2{{5, 5}, {4, 9}});
  EXPECT_EQ(box, before);
}

TEST(Box, NanIsNowhere) {
  Box2 box{{0, 0}, {2, 1}};
  const Box2 before = box;
  box.include(Point2{kNan, kNan});
  EXPECT_EQ(box, before);
  EXPECT_FALSE(box.contains(Point2{kNan, 0}));
  EXPECT_FALSE(box.intersects(Box2{{kNan, 0}, {1, 1}}));
  EXPECT_FALSE(box.covers(Box2{{0, 0}, {1, kNan}}));
  EXPECT_TRUE((Box2{{0, kNan}, {1, 1}}.empty()));
}

/// Laws over random boxes with few coordinates, so that borders often coincide.
TEST(Box, LawsHoldOnRandomBoxes) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> draw(-3, 3);
  const auto point = [&] {
    return Point2{static_cast<double>(draw(random)), static_cast<double>(draw(random))};
  };
  for (int round = 0; round < 2000; ++round) {
    const std::vector<Point2> some{point(), point()}, more{point(), point(), point()};
    const Box2 a = box_of(some), b = box_of(more);
    const Point2 p = point();
    EXPECT_EQ(a.intersects(b), b.intersects(a));
    EXPECT_EQ(a.covers(b), a.contains(b.min) && a.contains(b.max));
    if (a.contains(p) && b.contains(p)) {
      EXPECT_TRUE(a.intersects(b));
    }
    Box2 joined = a;
    joined.include(b);
    EXPECT_TRUE(joined.covers(a) && joined.covers(b));
    Box2 other = b;
    other.include(a);
    EXPECT_EQ(joined, other);
    for (const Point2& q : more) EXPECT_TRUE(b.contains(q));
  }
}

}  // namespace
}  // namespace terrace::base
