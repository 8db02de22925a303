// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
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

TEST(Box, MayHaveOtherCoordinates) {
  using IntegerBox = Box<3, std::int32_t>;
  IntegerBox integers;
  EXPECT_TRUE(integers.empty());
  integers.include(IntegerBox::Point{INT32_MIN, 2, INT32_MAX});
  integers.include(IntegerBox::Point{5, -1, INT32_MAX});
  EXPECT_EQ(integers, (IntegerBox{{INT32_MIN, -1, INT32_MAX}, {5, 2, INT32_MAX}}));
  using FloatBox = Box<2, float>;
  FloatBox floats;
  EXPECT_TRUE(floats.empty());
  floats.include(FloatBox::Point{1.5F, 2.5F});
  EXPECT_EQ(floats, (FloatBox{{1.5F, 2.5F}, {1.5F, 2.5F}}));
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

TEST(Box, IsWidenedOnAllSides) {
  EXPECT_EQ((Box2{{0, 0}, {2, 1}}.widened(0.5)), (Box2{{-0.5, -0.5}, {2.5, 1.5}}));
  EXPECT_TRUE(Box2{}.widened(3).empty());
}

TEST(Box, HasSquaredDistances) {
  constexpr Box2 box{{0, 0}, {2, 1}};
  EXPECT_EQ(box.squared_distance(Point2{1, 1}), 0);
  EXPECT_EQ(box.squared_distance(Point2{5, 0.5}), 9);
  EXPECT_EQ(box.squared_distance(Point2{-3, 5}), 25);
  EXPECT_EQ(box.squared_distance(Box2{{2, 1}, {3, 3}}), 0);
  EXPECT_EQ(box.squared_distance(Box2{{5, -9}, {6, -4}}), 25);
  EXPECT_EQ((Box2{{5, -9}, {6, -4}}.squared_distance(box)), 25);
}

/// Uses coordinates with many digits, so that every operation is rounded.
TEST(Box, RoundingDoesNotRaiseDistances) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> draw(-1, 1);
  const auto point = [&] { return Point3{draw(random), draw(random), draw(random)}; };
  const auto squared = [](const Point3& a, const Point3& b) {
    double sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) sum += (a[axis] - b[axis]) * (a[axis] - b[axis]);
    return sum;
  };
  for (int round = 0; round < 2000; ++round) {
    const std::vector<Point3> some{point(), point(), point()}, more{point(), point()};
    const Box3 a = box_of(some), b = box_of(more);
    for (const Point3& q : more) {
      EXPECT_LE(a.squared_distance(b), a.squared_distance(q));
      for (const Point3& p : some) EXPECT_LE(a.squared_distance(q), squared(p, q));
    }
  }
}

TEST(Box, DoesNotContainNan) {
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
