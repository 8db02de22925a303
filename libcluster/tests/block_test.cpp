// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/block.hpp"

#include <gtest/gtest.h>

#include "clustering_laws.hpp"
#include "inputs.hpp"
#include "terrace/cluster/local_search.hpp"

namespace terrace::cluster {
namespace {

constexpr double kFloatSlack = 1e-6;

struct Named {
  const char* name;
  std::vector<Point3> points;
};

std::vector<Named> ordinary_blocks(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Named> blocks;
  blocks.push_back({"dem", inputs::dem_tiles(100, 100, 30.0, 2.65, random)});
  blocks.push_back({"small dem", inputs::dem_tiles(40, 40, 30.0, 2.65, random)});
  blocks.push_back({"scan", inputs::scan(2, 60, random)});
  blocks.push_back({"cube", inputs::cube(5000, random)});
  blocks.push_back({"small cube", inputs::cube(100, random)});
  return blocks;
}

TEST(BlockClusterer, ResultsAreValid) {
  BlockClusterer clusterer;
  BlockClustering clustering;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    for (const Named& block : ordinary_blocks(seed)) {
      for (const Effort effort : {Effort::fast, Effort::standard, Effort::fine}) {
        SCOPED_TRACE(testing::Message()
                     << block.name << ", seed " << seed << ", effort " << static_cast<int>(effort));
        const BlockOptions options{.effort = effort, .seed = seed};
        clusterer.run(block.points, {}, options, clustering);
        laws::expect_valid(block.points, {}, options, clustering, kFloatSlack);
      }
    }
  }
}

TEST(BlockClusterer, EqualPointsAreOneCluster) {
  BlockClusterer clusterer;
  BlockClustering clustering;
  for (const std::size_t count : {1u, 2u, 17u, 2499u, 3000u}) {
    SCOPED_TRACE(count);
    const std::vector<Point3> points(count, Point3{5e6, -1, 0.1});
    clusterer.run(points, {}, {}, clustering);
    laws::expect_valid(points, {}, {}, clustering, 0);
    EXPECT_EQ(clustering.facilities.size(), 1u);
    EXPECT_EQ(clustering.cost(), 0.0);
  }
}

}  // namespace
}  // namespace terrace::cluster
