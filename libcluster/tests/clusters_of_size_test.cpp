// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "terrace/cluster/hierarchy.hpp"

namespace terrace::cluster {
namespace {

std::vector<Point3> uniform_points(std::size_t n) {
  std::mt19937_64 random(n);
  std::vector<Point3> points(n);
  for (auto& p : points) {
    for (double& c : p) c = static_cast<double>(random() >> 11) * 0x1p-53;
  }
  return points;
}

std::vector<std::size_t> sizes_of(const std::vector<std::uint32_t>& labels) {
  std::vector<std::size_t> sizes(*std::max_element(labels.begin(), labels.end()) + std::size_t{1});
  for (const std::uint32_t label : labels) ++sizes[label];
  return sizes;
}

TEST(ClustersOfSize, ClustersHaveAboutTheRequestedSize) {
  const auto points = uniform_points(60000);
  for (const double size : {100.0, 10000.0}) {
    const std::vector<std::size_t> sizes = sizes_of(clusters_of_size(points, size, 1, 2));
    EXPECT_EQ(std::count(sizes.begin(), sizes.end(), 0), 0);
    const double mean = 60000.0 / static_cast<double>(sizes.size());
    EXPECT_GT(mean, size / 10);
    EXPECT_LT(mean, size * 10);
  }
}

TEST(ClustersOfSize, ClustersAreCompact) {
  const auto points = uniform_points(60000);
  const auto labels = clusters_of_size(points, 100, 1, 2);
  std::vector<std::vector<Point3>> members(sizes_of(labels).size());
  for (std::size_t i = 0; i < points.size(); ++i) members[labels[i]].push_back(points[i]);
  double widest = 0.0;
  for (const auto& of_cluster : members) {
    const Box3 box = base::box_of(of_cluster);
    for (std::size_t d = 0; d < 3; ++d) widest = std::max(widest, box.max[d] - box.min[d]);
  }
  // A block of 10,000 points is half as wide as the whole set.
  EXPECT_LT(widest, 0.4);
}

TEST(ClustersOfSize, DoesNotDependOnThreads) {
  const auto points = uniform_points(45000);
  EXPECT_EQ(clusters_of_size(points, 1000, 1, 1), clusters_of_size(points, 1000, 1, 3));
}

TEST(ClustersOfSize, FewPointsAreOneCluster) {
  for (const std::size_t n : {1u, 50u, 10000u}) {
    EXPECT_EQ(clusters_of_size(uniform_points(n), 10000, 1, 1), std::vector<std::uint32_t>(n, 0));
  }
}

TEST(ClustersOfSize, RejectsSizesThatAreNotPositive) {
  for (const double size : {0.0, -80.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW((void)clusters_of_size(uniform_points(20), size, 1, 1), std::invalid_argument);
  }
}

}  // namespace
}  // namespace terrace::cluster
