// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/block.hpp"

#include <stdexcept>
#include <tuple>

#include <gtest/gtest.h>

#include "clustering_laws.hpp"
#include "inputs.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

struct Block {
  std::string name;
  std::vector<Point3> points;
  std::vector<double> weights = {};
};

std::vector<Block> ordinary_blocks(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Block> blocks;
  blocks.push_back({"dem", inputs::dem_tiles(100, 100, 30.0, 2.65, random)});
  blocks.push_back({"small dem", inputs::dem_tiles(40, 40, 30.0, 2.65, random)});
  blocks.push_back({"scan", inputs::scan(2, 60, random)});
  blocks.push_back({"cube", inputs::cube(5000, random)});
  blocks.push_back({"small cube", inputs::cube(100, random)});
  for (const std::size_t count : {2u, 3u, 15u, 16u, 17u, 2500u}) {
    blocks.push_back({std::to_string(count) + " points", inputs::cube(count, random)});
  }
  if (seed == 1) blocks.push_back({"large", inputs::cube(30000 / TERRACE_TEST_SHARE, random)});
  Block weighted{"weighted", inputs::cube(4000, random)};
  for (std::size_t i = 0; i < weighted.points.size(); ++i) {
    weighted.weights.push_back(0.01 + 5 * inputs::uniform(random) * inputs::uniform(random));
  }
  blocks.push_back(weighted);
  return blocks;
}

/// Returns blocks that break careless code, each at several sizes.
std::vector<Block> degenerate_blocks(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Block> blocks;
  for (const std::size_t count : {40u, 3000u}) {
    const std::string size = " of " + std::to_string(count);
    const std::vector<Point3> cube = inputs::cube(count, random);
    const auto add = [&](const std::string& name, auto change) {
      std::vector<Point3> points = cube;
      for (Point3& p : points) change(p);
      blocks.push_back({name + size, points});
    };
    add("line along x", [](Point3& p) { p = {p[0], 2, 3}; });
    add("skew line", [](Point3& p) { p = {p[0], p[0] * 0.5, -p[0]}; });
    add("plane", [](Point3& p) { p[1] = 7; });
    add("few places", [](Point3& p) {
      for (double& v : p) v = std::floor(v * 2);
    });
    add("two places", [](Point3& p) { p = p[0] < 0.3 ? Point3{0, 0, 0} : Point3{1, 1, 1}; });
    add("UTM", [](Point3& p) {
      p = {5e5 + std::floor(p[0] * 50), 5e6 + std::floor(p[1] * 50), p[2]};
    });
    add("far off", [](Point3& p) {
      p = {1e15 + std::floor(p[0] * 50), -1e15, std::floor(p[2] * 50)};
    });
    add("huge", [](Point3& p) {
      for (double& v : p) v = (v - 0.5) * 1e300;
    });
    add("greatest", [](Point3& p) {
      for (double& v : p) v = (v - 0.5) * 1e303;
    });
    add("tiny", [](Point3& p) {
      for (double& v : p) v *= 1e-300;
    });
    add("denormal", [](Point3& p) {
      for (double& v : p) v = std::floor(v * 100) * 5e-324;
    });
    add("one outlier", [&](Point3& p) {
      if (p == cube[7]) p = {1e6, 1e6, 1e6};
    });
    add("negative zeros", [](Point3& p) { p = {p[0] < 0.5 ? -0.0 : 0.0, p[1], -0.0}; });
    std::vector<Point3> sorted = cube;
    std::sort(sorted.begin(), sorted.end());
    blocks.push_back({"sorted" + size, sorted});

    const auto weigh = [&](const std::string& name, auto weight) {
      Block block{name + size, cube};
      for (std::size_t i = 0; i < count; ++i) block.weights.push_back(weight(i));
      blocks.push_back(block);
    };
    weigh("weights 1e-9", [](std::size_t) { return 1e-9; });
    weigh("weights 1e12", [](std::size_t) { return 1e12; });
    weigh("weights of all sizes", [&](std::size_t i) {
      return std::pow(10.0, static_cast<double>(i % 22) - 9.0) * (1 + inputs::uniform(random));
    });
    weigh("one heavy point", [](std::size_t i) { return i == 3 ? 1e12 : 1e-9; });
    weigh("absurd weights", [](std::size_t i) { return i % 2 == 0 ? 1e290 : 1e-290; });
  }
  return blocks;
}

/// Returns the available paths other than the portable one.
std::vector<SimdPath> available_paths() {
  std::vector<SimdPath> paths;
  for (const SimdPath path : {SimdPath::avx2, SimdPath::avx512}) {
    try {
      BlockClusterer clusterer(path);
      paths.push_back(path);
    } catch (const std::invalid_argument&) {
    }
  }
  return paths;
}

constexpr double kFacilityCosts[] = {0.05, 1.0, 4.0};
constexpr Effort kEfforts[] = {Effort::fast, Effort::standard, Effort::fine};

void expect_same(const BlockClustering& a, const BlockClustering& b) {
  EXPECT_EQ(a.facilities, b.facilities);
  EXPECT_EQ(a.assignment, b.assignment);
  EXPECT_EQ(a.facility_cost, b.facility_cost);
  EXPECT_EQ(a.connection_cost, b.connection_cost);
}

TEST(BlockClusterer, ResultsAreValidAndTheSameOnAllPaths) {
  std::vector<BlockClusterer> clusterers;
  for (const SimdPath path : available_paths()) clusterers.emplace_back(path);
  BlockClusterer portable(SimdPath::portable);
  std::size_t blocks_seen = 0;
  for (std::uint64_t seed = 1; seed <= 2; seed += TERRACE_TEST_SHARE) {
    std::vector<Block> blocks = ordinary_blocks(seed);
    if (seed == 1) {
      for (Block& block : degenerate_blocks(seed)) blocks.push_back(std::move(block));
    }
    for (const Block& block : blocks) {
      const std::size_t turn = ++blocks_seen;
      const double facility_cost = kFacilityCosts[turn % 3];
      const Effort effort = kEfforts[turn / 3 % 3];
      SCOPED_TRACE(testing::Message() << block.name << ", seed " << seed << ", effort "
                                      << static_cast<int>(effort) << ", cost " << facility_cost);
      const BlockOptions options{.facility_cost = facility_cost, .effort = effort, .seed = seed};
      BlockClustering expected;
      portable.run(block.points, block.weights, options, expected);
      laws::expect_valid(block.points, block.weights, options, expected, laws::kFloatSlack);
      // Each clusterer has seen other blocks before, so this also shows that nothing carries over.
      for (BlockClusterer& clusterer : clusterers) {
        BlockClustering clustering;
        clusterer.run(block.points, block.weights, options, clustering);
        expect_same(clustering, expected);
      }
      if (testing::Test::HasFailure()) return;
    }
  }
}

TEST(BlockClusterer, KeepsNoStateBetweenBlocks) {
  std::mt19937_64 random(3);
  const std::vector<Point3> block = inputs::cube(3000, random);
  const std::vector<Point3> larger = inputs::dem_tiles(100, 100, 30.0, 2.65, random);
  BlockClustering fresh;
  BlockClusterer().run(block, {}, {}, fresh);
  BlockClusterer used;
  BlockClustering clustering;
  used.run(larger, {}, {.facility_cost = 0.01, .effort = Effort::fast}, clustering);
  used.run(larger, std::vector<double>(larger.size(), 3.0), {}, clustering);
  used.run({}, {}, {}, clustering);
  used.run(block, {}, {}, clustering);
  expect_same(clustering, fresh);
  BlockClusterer moved = std::move(used);
  moved.run(block, {}, {}, clustering);
  expect_same(clustering, fresh);
}

TEST(BlockClusterer, EqualPointsAreOneCluster) {
  BlockClusterer clusterer;
  BlockClustering clustering;
  for (const std::size_t count : {1u, 2u, 17u, 2499u, 3000u}) {
    SCOPED_TRACE(count);
    const std::vector<Point3> points(count, Point3{5e6, -1, 0.1});
    clusterer.run(points, std::vector<double>(count, 1e12), {}, clustering);
    laws::expect_valid(points, {}, {}, clustering, 0);
    EXPECT_EQ(clustering.facilities.size(), 1u);
    EXPECT_EQ(clustering.cost(), 0.0);
  }
}

TEST(BlockClusterer, NoPointsGiveAnEmptyResult) {
  BlockClusterer clusterer;
  BlockClustering clustering;
  clustering.facilities = {4};
  clustering.assignment = {0, 0};
  clusterer.run({}, {}, {}, clustering);
  EXPECT_TRUE(clustering.facilities.empty());
  EXPECT_TRUE(clustering.assignment.empty());
  EXPECT_EQ(clustering.cost(), 0.0);
}

TEST(BlockClusterer, DistantPlacesGetSeparateFacilities) {
  // Two places with 500 points each. Joining them would cost far more than a facility.
  std::vector<Point3> points;
  for (int i = 0; i < 1000; ++i) points.push_back({i % 2 == 0 ? 0.0 : 1.0, 0, 0});
  BlockClusterer clusterer;
  BlockClustering clustering;
  clusterer.run(points, {}, {}, clustering);
  EXPECT_EQ(clustering.facilities.size(), 2u);
  EXPECT_EQ(clustering.connection_cost, 0.0);
}

TEST(BlockClusterer, SeparatesHeavyPointsThatCoincideInFloat) {
  // The two points are 1e-9 of the box apart. They coincide in single precision, but the difference
  // is worth 1e3 facilities.
  std::mt19937_64 random(9);
  std::vector<Point3> points = inputs::cube(3000, random);
  std::vector<double> weights(points.size(), 1.0);
  points[100] = {0.5, 0.5, 0.5};
  points[2000] = {0.5 + 1e-9, 0.5, 0.5};
  weights[100] = weights[2000] = 1e12;
  BlockClusterer clusterer;
  BlockClustering clustering;
  clusterer.run(points, weights, {}, clustering);
  laws::expect_valid(points, weights, {}, clustering, laws::kFloatSlack);
  for (const std::uint32_t i : {100u, 2000u}) {
    EXPECT_EQ(clustering.facilities[clustering.assignment[i]], i);
  }
}

TEST(BlockClusterer, TinyFacilityCostMakesEveryPointAFacility) {
  std::mt19937_64 random(4);
  const std::vector<Point3> points = inputs::cube(3000, random);
  BlockClusterer clusterer;
  BlockClustering clustering;
  const BlockOptions options{.facility_cost = 1e-7};
  clusterer.run(points, {}, options, clustering);
  laws::expect_valid(points, {}, options, clustering, laws::kFloatSlack);
  EXPECT_GE(clustering.facilities.size(), 2990u);
}

TEST(BlockClusterer, HugeFacilityCostGivesOneCluster) {
  std::mt19937_64 random(4);
  BlockClusterer clusterer;
  BlockClustering clustering;
  for (const std::size_t count : {50u, 4000u}) {
    const std::vector<Point3> points = inputs::cube(count, random);
    const BlockOptions options{.facility_cost = 1e20};
    clusterer.run(points, {}, options, clustering);
    laws::expect_valid(points, {}, options, clustering, laws::kFloatSlack);
    EXPECT_EQ(clustering.facilities.size(), 1u);
  }
}

TEST(BlockClusterer, ScaleOffsetAndEqualWeightsChangeNothing) {
  std::mt19937_64 random(6);
  std::vector<Point3> points = inputs::cube(3000, random);
  for (Point3& p : points) {
    for (double& v : p) v = std::floor(v * 1000);  // makes moving exact
  }
  BlockClusterer clusterer;
  BlockClustering expected;
  clusterer.run(points, {}, {}, expected);
  for (const auto& [scale, offset] : {std::tuple{1.0, 4e6}, std::tuple{0x1p-900, 0.0},
                                      std::tuple{0x1p900, 0.0}, std::tuple{0x1p-40, 16.0}}) {
    SCOPED_TRACE(testing::Message() << "scale " << scale << ", offset " << offset);
    std::vector<Point3> moved = points;
    for (Point3& p : moved) {
      for (double& v : p) v = v * scale + offset;
    }
    BlockClustering clustering;
    clusterer.run(moved, std::vector<double>(points.size(), 1.0), {}, clustering);
    EXPECT_EQ(clustering.facilities, expected.facilities);
    EXPECT_EQ(clustering.assignment, expected.assignment);
    EXPECT_EQ(clustering.connection_cost, expected.connection_cost * scale);
  }
}

TEST(BlockClusterer, CostsBeyondTheRangeOfDoubleAreInfinite) {
  std::vector<Point3> points;
  for (int i = 0; i < 60; ++i) {
    points.push_back({i % 2 == 0 ? -1.7e308 : 1.7e308, i % 3 == 0 ? -1.7e308 : 1.7e308, 1e300 * i});
  }
  BlockClusterer clusterer;
  BlockClustering clustering;
  clusterer.run(points, {}, {}, clustering);
  ASSERT_EQ(clustering.facilities.size(), 4u);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point3& f = points[clustering.facilities[clustering.assignment[i]]];
    EXPECT_EQ(f[0], points[i][0]);
    EXPECT_EQ(f[1], points[i][1]);
  }
  EXPECT_EQ(clustering.facility_cost, std::numeric_limits<double>::infinity());
}

TEST(BlockClusterer, RejectsUnavailablePaths) {
  EXPECT_NO_THROW(BlockClusterer{SimdPath::portable});
  EXPECT_NO_THROW(BlockClusterer{SimdPath::automatic});
  EXPECT_NO_THROW(BlockClusterer{best_simd_path()});
  // Paths are numbered from the slowest. No machine has the last one.
  constexpr auto kOfNoMachine = static_cast<SimdPath>(255);
  for (const SimdPath path : {SimdPath::avx2, SimdPath::avx512, kOfNoMachine}) {
    if (path <= best_simd_path()) {
      EXPECT_NO_THROW(BlockClusterer{path}) << static_cast<int>(path);
    } else {
      EXPECT_THROW(BlockClusterer{path}, std::invalid_argument) << static_cast<int>(path);
    }
  }
}

}  // namespace
}  // namespace terrace::cluster
