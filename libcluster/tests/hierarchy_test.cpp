// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/hierarchy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "hierarchy_laws.hpp"
#include "inputs.hpp"
#include "recording_sink.hpp"

/// The guarantees of the hierarchy, with the real clustering, on ordinary and degenerate inputs.

namespace terrace::cluster {
namespace {

HierarchyResult build(const std::vector<Point3>& points, HierarchyOptions options,
                      RecordingSink& sink, std::size_t batch) {
  options.payload_size = sizeof(std::uint64_t);
  HierarchyBuilder builder(std::move(options), sink);
  for (std::size_t i = 0; i < points.size(); i += batch) {
    const std::size_t end = std::min(i + batch, points.size());
    builder.push(std::span(points).subspan(i, end - i), numbered_payload(i, end));
  }
  return builder.finish();
}

struct Input {
  std::string name;
  std::vector<Point3> points;
};

std::vector<Input> all_inputs() {
  std::mt19937_64 random(20240601);
  std::vector<Input> inputs;
  inputs.push_back({"cube", inputs::cube(1500, random)});
  inputs.push_back({"scan", inputs::scan(6, 10, random)});
  inputs.push_back({"terrain", inputs::dem_tiles(32, 8, 30.0, 10.0, random)});

  std::vector<Point3> points(700, Point3{3.25, -7.5, 1e6});
  inputs.push_back({"all equal", points});
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double t = static_cast<double>(i);
    points[i] = {t, 0.3 * t, -0.7 * t};
  }
  inputs.push_back({"collinear", points});
  for (Point3& p : points) {
    p = {4e5 + 1e-3 * inputs::uniform(random), 5.2e6 + 1e-3 * inputs::uniform(random), 0.0};
  }
  inputs.push_back({"huge offset", points});
  for (Point3& p : points) {
    for (double& x : p) x = std::floor(3.0 * inputs::uniform(random));
  }
  inputs.push_back({"many duplicates", points});
  double size = 1.0;
  for (Point3& p : points) {
    p = {size * inputs::uniform(random), size * inputs::uniform(random), 0.0};
    size = size > 1e100 ? 1e-100 : size * 1.5;
  }
  inputs.push_back({"scales of all orders", points});
  return inputs;
}

TEST(Hierarchy, GuaranteesHoldOnAllInputs) {
  for (const Input& input : all_inputs()) {
    for (const std::size_t block_size : {2u, 3u, 17u, 100u, 699u, 700u, 701u}) {
      SCOPED_TRACE(input.name + ", blocks of " + std::to_string(block_size));
      HierarchyOptions options;
      options.block_size = block_size;
      RecordingSink sink;
      const HierarchyResult result = build(input.points, options, sink, 64);
      laws::check_hierarchy(sink, result, input.points, block_size);
    }
  }
}

TEST(Hierarchy, HandlesSizesAroundMultiplesOfTheBlock) {
  std::mt19937_64 random(3);
  const std::vector<Point3> all = inputs::cube(100, random);
  for (std::size_t n = 0; n <= 41; ++n) {
    for (const std::size_t batch : {1u, 7u, 10u, 11u, 100u}) {
      SCOPED_TRACE(std::to_string(n) + " points in batches of " + std::to_string(batch));
      const std::vector<Point3> points(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(n));
      HierarchyOptions options;
      options.block_size = 10;
      RecordingSink sink;
      const HierarchyResult result = build(points, options, sink, batch);
      laws::check_hierarchy(sink, result, points, 10);
    }
  }
}

TEST(Hierarchy, NoPointsGiveAnEmptyRoot) {
  RecordingSink sink;
  const HierarchyResult result = build({}, {}, sink, 1);
  laws::check_hierarchy(sink, result, {}, 10000);
  EXPECT_EQ(result.top, 0u);
  EXPECT_GT(sink.top.summaries[0].box.min[0], sink.top.summaries[0].box.max[0]);
}

TEST(Hierarchy, DoesNotDependOnThreads) {
  std::mt19937_64 random(7);
  const std::vector<Point3> points = inputs::scan(11, 10, random);
  HierarchyOptions options;
  options.block_size = 60;
  RecordingSink one;
  const HierarchyResult result = build(points, options, one, 25);
  laws::check_hierarchy(one, result, points, 60);
  ASSERT_GE(result.top, 2u);
  for (const unsigned threads : {0u, 2u, 3u, 8u}) {
    for (int repeat = 0; repeat < 5; ++repeat) {
      SCOPED_TRACE(std::to_string(threads) + " threads");
      options.threads = threads;
      RecordingSink sink;
      const HierarchyResult other = build(points, options, sink, 25);
      EXPECT_EQ(sink.levels, one.levels);
      EXPECT_EQ(sink.top, one.top);
      EXPECT_EQ(other.level_points, result.level_points);
      EXPECT_EQ(other.level_clusters, result.level_clusters);
    }
  }
}

TEST(Hierarchy, DependsOnTheSeed) {
  std::mt19937_64 random(8);
  const std::vector<Point3> points = inputs::cube(3000, random);
  HierarchyOptions options;
  options.block_size = 300;
  RecordingSink a, b;
  build(points, options, a, 300);
  options.block.seed = 2;
  build(points, options, b, 300);
  EXPECT_NE(a.levels, b.levels);
}

TEST(Hierarchy, FacilityCostTooLowStillEnds) {
  std::mt19937_64 random(9);
  const std::vector<Point3> points = inputs::cube(2000, random);
  for (const double cost : {1e-300, 1e-9, 1e-3, 0.05}) {
    SCOPED_TRACE(cost);
    HierarchyOptions options;
    options.block_size = 50;
    options.block.facility_cost = cost;
    RecordingSink sink;
    const HierarchyResult result = build(points, options, sink, 50);
    laws::check_hierarchy(sink, result, points, 50);
  }
}

// Scales are powers of two, so that the twin's coordinates, which are products, are exact.
TEST(Hierarchy, DegreesClusterLikeMetres) {
  std::mt19937_64 random(10);
  const double kEast = 0x1p16;
  const double kNorth = 0x1p17;
  std::vector<Point3> metres = inputs::dem_tiles(64, 16, 32.0, 8.0, random);
  std::vector<Point3> degrees = metres;
  for (Point3& p : degrees) p = {p[0] / kEast, p[1] / kNorth, p[2]};

  HierarchyOptions options;
  options.block_size = 512;
  RecordingSink by_metres, by_degrees, without_map;
  const HierarchyResult result = build(metres, options, by_metres, 256);
  build(degrees, options, without_map, 256);
  options.ground = [&](const Box3&) { return GroundMap{kEast, 0, 0, 0, kNorth, 0, 0, 0, 1}; };
  const HierarchyResult twin = build(degrees, options, by_degrees, 256);
  laws::check_hierarchy(by_degrees, twin, degrees, 512,
                        GroundMap{kEast, 0, 0, 0, kNorth, 0, 0, 0, 1});

  ASSERT_EQ(result.level_clusters, twin.level_clusters);
  ASSERT_GE(result.top, 1u);
  for (std::size_t level = 0; level < by_metres.levels.size(); ++level) {
    for (std::size_t b = 0; b < by_metres.levels[level].size(); ++b) {
      const RecordedBlock& x = by_metres.levels[level][b];
      const RecordedBlock& y = by_degrees.levels[level][b];
      EXPECT_EQ(x.order, y.order);
      EXPECT_EQ(x.first, y.first);
      EXPECT_EQ(x.representatives, y.representatives);
      for (std::size_t c = 0; c < x.summaries.size(); ++c) {
        EXPECT_DOUBLE_EQ(x.summaries[c].error, y.summaries[c].error);
      }
    }
  }
  // Degrees combined with heights in metres make height bands, which are entirely different
  // clusters.
  EXPECT_NE(by_metres.levels[0][0].order, without_map.levels[0][0].order);
}

TEST(Hierarchy, AcceptsAnyLinearMapAndLargeOffsets) {
  std::mt19937_64 random(11);
  std::vector<Point3> points = inputs::cube(1000, random);
  for (Point3& p : points) p = {p[0] + 4e5, p[1] + 5.2e6, 100.0 * p[2]};
  const std::vector<GroundMap> maps = {
      {0.5, 0.25, 0, -0.25, 0.5, 0, 0, 0, 3},          // rotated
      {1, -1, 0, 1, 1e-9, 0, 0, 0, 1},                 // skewed
      {78000.3, 0, 0, 0, -111000.7, 0, 0, 0, 0.3048},  // mirrored
      {1, 0, 0, 0, 1, 0, 0, 0, 0},                     // heights do not count
  };
  for (const GroundMap& map : maps) {
    SCOPED_TRACE(testing::PrintToString(map));
    HierarchyOptions options;
    options.block_size = 90;
    options.ground = [&](const Box3&) { return map; };
    RecordingSink sink;
    const HierarchyResult result = build(points, options, sink, 30);
    laws::check_hierarchy(sink, result, points, 90, map);
  }
}

}  // namespace
}  // namespace terrace::cluster
