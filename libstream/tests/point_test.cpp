// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/point.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "terrace/stream/schema.hpp"

namespace terrace::stream {
namespace {

TEST(Box3, StartsEmptyAndGrowsToWhatItIncludes) {
  Box3 box;
  EXPECT_TRUE(box.empty());
  EXPECT_FALSE(box.contains({0, 0, 0}));
  box.include(Point3{1, 2, 3});
  EXPECT_FALSE(box.empty());
  EXPECT_TRUE(box.contains({1, 2, 3}));
  box.include(Point3{-1, 5, 3});
  EXPECT_TRUE(box.contains({0, 2, 3}));
  EXPECT_FALSE(box.contains({0, 2, 3.5}));
}

TEST(Box3, IsClosed) {
  const Box3 a{{0, 0, 0}, {1, 1, 1}}, b{{1, 1, 1}, {2, 2, 2}};
  EXPECT_TRUE(a.intersects(b));
  EXPECT_FALSE(a.intersects(Box3{}));
}

TEST(Box3, IgnoresNaN) {
  Box3 box{{0, 0, 0}, {1, 1, 1}};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  box.include(Point3{nan, nan, nan});
  EXPECT_EQ(box, (Box3{{0, 0, 0}, {1, 1, 1}}));
  EXPECT_FALSE(box.contains({nan, 0.5, 0.5}));
}

// For the sanitizers: an empty view must not compute addresses.
TEST(Schema, ViewsRecordsThatAreNotThere) {
  Schema schema;
  schema.attributes = {{.name = "a", .type = ScalarType::f64},
                       {.name = "b", .type = ScalarType::u8}};
  EXPECT_EQ(schema.view<std::uint8_t>({}, 1).size(), 0u);
}

}  // namespace
}  // namespace terrace::stream
