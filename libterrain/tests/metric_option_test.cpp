// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>

#include "temporary_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/metric_choice.hpp"

namespace terrace::terrain {
namespace {

constexpr stream::Point3 kOrigin{0, 0, 0};
constexpr cluster::LinearMap kOne = cluster::kIdentityMap;

MetricChoice from_file(const std::string& json) {
  const tests::TemporaryFolder scratch;
  const std::string path = scratch.path() / "metric.json";
  std::ofstream(path) << json;
  return MetricChoice::parse("elliptical:" + path);
}

TEST(MetricOption, NamesMetrics) {
  using cluster::name_of;
  EXPECT_EQ(name_of(MetricChoice::parse("euclidean").on_ground(kOrigin, kOne)), "euclidean");
  EXPECT_EQ(name_of(MetricChoice::parse("squared").on_ground(kOrigin, kOne)), "squared");
  EXPECT_EQ(name_of(MetricChoice::parse("minkowski:1.5").on_ground(kOrigin, kOne)),
            "minkowski:1.5");
  const cluster::Metric largest = MetricChoice::parse("minkowski:inf").on_ground(kOrigin, kOne);
  EXPECT_EQ(cluster::distance(largest, {0, 0, 0}, {3, -4, 1}), 4.0);
  for (const char* text : {"", "manhattan", "minkowski", "minkowski:", "minkowski:0",
                           "minkowski:-1", "minkowski:x", "elliptical", "squared:2"}) {
    EXPECT_THROW(MetricChoice::parse(text), UsageError) << text;
  }
}

TEST(MetricOption, RegionWithoutBoxIsEverywhere) {
  const cluster::Metric metric =
      from_file(R"({"regions": [{"semi_axes": [4, 2], "angle": 90}]})").on_ground(kOrigin, kOne);
  EXPECT_EQ(cluster::name_of(metric), "elliptical");
  EXPECT_EQ(cluster::distance(metric, {0, 0, 0}, {0, 4, 0}), 1.0);
  EXPECT_EQ(cluster::distance(metric, {0, 0, 0}, {2, 0, 0}), 1.0);
}

TEST(MetricOption, BoxesUseCrsAndSemiAxesUseGround) {
  // Two metres per unit of x, around (100, 0, 0).
  const cluster::Metric metric =
      from_file(R"({"regions": [{"box": [110, -5, 120, 5], "semi_axes": [10, 1]}]})")
          .on_ground({100, 0, 0}, {2, 0, 0, 0, 1, 0, 0, 0, 1});
  // x = 115 is 30 on the ground.
  EXPECT_EQ(cluster::distance(metric, {30, 0, 0}, {40, 0, 0}), 1.0);
  EXPECT_EQ(cluster::distance(metric, {30, 0, 7}, {30, 1, 7}), 1.0);
  EXPECT_EQ(cluster::distance(metric, {50, 0, 0}, {40, 0, 0}), 10.0);
}

TEST(MetricOption, BoxesContainTheirPointsUnderAnyGroundMap) {
  // A projection far from its centre, and a rotated one, around a distant origin.
  const MetricChoice choice = from_file(
      R"({"regions": [{"box": [5000100, 2000200, 5000300, 2000600], "semi_axes": [10, 10, 10]}]})");
  const stream::Point3 origin{5000000, 2000000, 0};
  for (const cluster::LinearMap& map :
       {cluster::LinearMap{1.125, 0.0625, 0, 0.0625, 0.875, 0, 0, 0, 1},
        cluster::LinearMap{0.6, -0.8, 0, 0.8, 0.6, 0, 0, 0, 0.3048}}) {
    const cluster::Metric metric = choice.on_ground(origin, map);
    std::size_t inside = 0;
    for (int i = 0; i <= 40; ++i) {
      for (int k = 0; k <= 80; ++k) {
        // Some are on the sides and corners of the box, which is closed.
        const double x = 10.0 * i, y = 10.0 * k;
        const cluster::Point3 place{map[0] * x + map[1] * y, map[3] * x + map[4] * y, 0};
        const bool in = x >= 100 && x <= 300 && y >= 200 && y <= 600;
        inside += in ? 1 : 0;
        EXPECT_NEAR(cluster::distance(metric, place, {place[0] + 20, place[1], 0}), in ? 2 : 20,
                    1e-9)
            << x << ' ' << y;
      }
    }
    EXPECT_EQ(inside, 21U * 41U);
  }
}

TEST(MetricOption, UsesFirstRegionAndItsRotation) {
  const cluster::Metric metric = from_file(R"({"regions": [
      {"box": [0, 0, 0, 1, 1, 1], "semi_axes": [1, 1, 0.5],
       "rotation": [[0, 1, 0], [0, 0, 1], [1, 0, 0]]},
      {"semi_axes": [2, 2, 2]}]})")
                                     .on_ground(kOrigin, kOne);
  EXPECT_EQ(cluster::distance(metric, {1, 0, 0}, {2, 0, 0}), 2.0);  // the third axis is along x
  EXPECT_EQ(cluster::distance(metric, {5, 0, 0}, {7, 0, 0}), 1.0);
}

TEST(MetricOption, NamesRegionOfInvalidFile) {
  EXPECT_THROW(MetricChoice::parse("elliptical:no-such-file.json"), stream::Error);
  for (const char* json :
       {"", "[]", "{}", R"({"regions": []})", R"({"regions": 3})", R"({"regions": [3]})",
        R"({"regions": [{}]})", R"({"regions": [{"semi_axes": [1]}]})",
        R"({"regions": [{"semi_axes": [1, "2"]}]})", R"({"regions": [{"semi_axes": [1, 0]}]})",
        R"({"regions": [{"semi_axes": [1, -2]}]})", R"({"regions": [{"semi_axes": [1, 1e400]}]})",
        R"({"regions": [{"semi_axes": [1, 1e-310]}]})",
        R"({"regions": [{"semi_axes": [1, 2], "angle": "x"}]})",
        R"({"regions": [{"semi_axes": [1, 2], "angel": 3}]})",
        R"({"regions": [{"semi_axes": [1, 2], "box": [0, 0, 1]}]})",
        R"({"regions": [{"semi_axes": [1, 2], "box": [2, 0, 1, 1]}]})",
        R"({"regions": [{"semi_axes": [1, 2], "rotation": [[1, 0, 0], [0, 1, 0]]}]})",
        R"({"regions": [{"semi_axes": [1, 2], "rotation": [[1, 0, 0], [1, 1, 0], [0, 0, 1]]}]})"}) {
    EXPECT_THROW(from_file(json), stream::Error) << json;
  }
  try {
    from_file(R"({"regions": [{"semi_axes": [1, 2]}, {"semi_axes": [0, 2]}]})");
    FAIL();
  } catch (const stream::Error& error) {
    EXPECT_EQ(error.parts().where, "region 1");
  }
}

}  // namespace
}  // namespace terrace::terrain
