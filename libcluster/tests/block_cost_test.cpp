// SPDX-License-Identifier: Apache-2.0
// Compares the cost of clusterings with the optimum and with the reference search.
#include <gtest/gtest.h>

#include "clustering_laws.hpp"
#include "inputs.hpp"
#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

TEST(BlockCost, IsNearTheOptimumOnTinyBlocks) {
  BlockClusterer clusterer;
  BlockClustering clustering;
  double sum = 0.0;
  constexpr int kBlocks = 100;
  for (std::uint64_t seed = 1; seed <= kBlocks; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    std::vector<Point3> points = inputs::cube(2 + seed % 9, random);
    std::vector<double> weights;
    if (seed % 2 == 0) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        weights.push_back(0.2 + 3 * inputs::uniform(random));
      }
    }
    if (seed % 5 == 0) points.back() = points.front();
    const BlockOptions options{.facility_cost = 0.1 + 0.6 * inputs::uniform(random), .seed = seed};
    clusterer.run(points, weights, options, clustering);
    laws::expect_valid(points, weights, options, clustering, laws::kFloatSlack);
    const double best = laws::optimum(points, weights, options.facility_cost);
    if (best == 0.0) {  // two equal points
      ASSERT_EQ(clustering.cost(), 0.0);
      sum += 1.0;
      continue;
    }
    ASSERT_GE(clustering.cost(), best * (1 - 1e-9));
    ASSERT_LE(clustering.cost(), best * 3);  // the proven bound for a local optimum
    sum += clustering.cost() / best;
  }
  EXPECT_LE(sum / kBlocks, 1.03);
}

/// Mean cost over blocks, relative to the reference search.
struct Costs {
  double tenth = 0.0, full = 0.0;
  double fast = 0.0, standard = 0.0, fine = 0.0, engine_full = 0.0;
};

Costs costs_over(const std::vector<std::vector<Point3>>& blocks, double facility_cost) {
  Costs costs;
  BlockClusterer clusterer;
  BlockClustering clustering;
  std::uint64_t seed = 0;
  for (const std::vector<Point3>& points : blocks) {
    ++seed;
    const auto reference = [&](Effort effort) {
      return laws::textbook_search(points, facility_cost, effort, seed).cost();
    };
    const auto ours = [&](Effort effort) {
      clusterer.run(points, {}, {.facility_cost = facility_cost, .effort = effort, .seed = seed},
                    clustering);
      return clustering.cost();
    };
    costs.tenth += reference(Effort::standard);
    costs.full += reference(Effort::fine);
    costs.fast += ours(Effort::fast);
    costs.standard += ours(Effort::standard);
    costs.fine += ours(Effort::fine);
    costs.engine_full += ours(Effort::full);
  }
  return costs;
}

TEST(BlockCost, BeatsTheShortSearchAndIsCloseToTheFullOne) {
  for (const double facility_cost : {1.0, 2.0}) {
    std::vector<std::vector<Point3>> dem, scan, cube;
    for (std::uint64_t seed = 1; seed <= 3; seed += TERRACE_TEST_SHARE) {
      std::mt19937_64 random(seed);
      dem.push_back(inputs::dem_tiles(52, 52, 30.0, 2.65, random));
      scan.push_back(inputs::scan(2, 38, random));
      cube.push_back(inputs::cube(2600, random));
    }
    for (const auto& [name, blocks] : {std::pair{"dem", dem}, {"scan", scan}, {"cube", cube}}) {
      SCOPED_TRACE(testing::Message() << name << ", facility cost " << facility_cost);
      const Costs costs = costs_over(blocks, facility_cost);
      EXPECT_LE(costs.fast, costs.tenth);
      EXPECT_LE(costs.standard, 0.99 * costs.tenth);
      EXPECT_LE(costs.standard, 1.03 * costs.full);
      EXPECT_LE(costs.fine, 1.02 * costs.full);
      EXPECT_LE(costs.engine_full, 1.005 * costs.full);
      EXPECT_LE(costs.fine, costs.standard);
      EXPECT_LE(costs.standard, costs.fast);
    }
  }
}

TEST(BlockCost, IsLowOnLinesClustersAndMixedDensity) {
  // A wrong number of seeds would show on these inputs.
  std::mt19937_64 random(12);
  std::vector<Point3> line, groups, mixed, rows;
  for (int i = 0; i < 3000; ++i) {
    line.push_back({inputs::uniform(random), 0, 0});
    const double g = std::floor(30 * inputs::uniform(random));
    groups.push_back({std::fmod(g * 0.618034, 1.0) + 0.004 * inputs::bell(random),
                      g / 30 + 0.004 * inputs::bell(random), 0});
    const double u = inputs::uniform(random);
    mixed.push_back({u * u * u, inputs::uniform(random) * (i % 2 == 0 ? 1 : 0.05), 0});
    rows.push_back({static_cast<double>(i % 1500), static_cast<double>(i / 1500), 0});
  }
  for (const auto& [name, points] : {std::pair{"line", line},
                                     {"groups", groups},
                                     {"mixed density", mixed},
                                     {"two rows of a raster", rows}}) {
    SCOPED_TRACE(name);
    const Costs costs = costs_over({points}, 1.0);
    EXPECT_LE(costs.standard, 1.005 * costs.tenth);
    EXPECT_LE(costs.standard, 1.03 * costs.full);
    EXPECT_LE(costs.fine, 1.02 * costs.full);
  }
}

TEST(BlockCost, WeightsCountLikeCoincidentPoints) {
  // A point of weight w must count like w coincident points.
  std::mt19937_64 random(8);
  std::vector<Point3> points = inputs::cube(2600, random);
  std::vector<Point3> repeated;
  std::vector<double> weights;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t times = 1 + i % 3;
    weights.push_back(static_cast<double>(times));
    for (std::size_t k = 0; k < times; ++k) repeated.push_back(points[i]);
  }
  BlockClusterer clusterer;
  BlockClustering weighted, plain;
  clusterer.run(points, weights, {.effort = Effort::fine}, weighted);
  clusterer.run(repeated, {}, {.effort = Effort::fine}, plain);
  EXPECT_NEAR(weighted.cost(), plain.cost(), 0.02 * plain.cost());
}

}  // namespace
}  // namespace terrace::cluster
