// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/facility_labels.hpp"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "terrace/stream/point.hpp"

namespace terrace::tools {
namespace {

std::vector<stream::Point3> uniform_points(std::size_t n) {
  std::mt19937_64 random(n);
  std::vector<stream::Point3> points(n);
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

const auto kQuiet = [](std::uint64_t) {};

TEST(FacilityLabels, ClustersAreAboutAsLargeAsAsked) {
  const auto points = uniform_points(60000);
  for (const double size : {100.0, 10000.0}) {
    const std::vector<std::size_t> sizes = sizes_of(facility_labels(points, size, 1, 2, kQuiet));
    EXPECT_EQ(std::count(sizes.begin(), sizes.end(), 0), 0);
    const double mean = 60000.0 / static_cast<double>(sizes.size());
    EXPECT_GT(mean, size / 10);
    EXPECT_LT(mean, size * 10);
  }
}

TEST(FacilityLabels, ClustersAreCompact) {
  const auto points = uniform_points(60000);
  const auto labels = facility_labels(points, 100, 1, 2, kQuiet);
  std::vector<stream::Box3> boxes(sizes_of(labels).size());
  for (std::size_t i = 0; i < points.size(); ++i) boxes[labels[i]].include(points[i]);
  double widest = 0.0;
  for (const auto& box : boxes) {
    for (std::size_t d = 0; d < 3; ++d) widest = std::max(widest, box.max[d] - box.min[d]);
  }
  // A block of 10,000 points is half as wide as all.
  EXPECT_LT(widest, 0.4);
}

TEST(FacilityLabels, ThreadsDoNotMatter) {
  const auto points = uniform_points(45000);
  EXPECT_EQ(facility_labels(points, 1000, 1, 1, kQuiet),
            facility_labels(points, 1000, 1, 3, kQuiet));
}

TEST(FacilityLabels, FewPointsAreOneCluster) {
  for (const std::size_t n : {1u, 50u, 10000u}) {
    EXPECT_EQ(facility_labels(uniform_points(n), 10000, 1, 1, kQuiet),
              std::vector<std::uint32_t>(n, 0));
  }
}

}  // namespace
}  // namespace terrace::tools
