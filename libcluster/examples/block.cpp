// SPDX-License-Identifier: Apache-2.0
// Clusters the points of a small hill and prints the largest clusters.
#include "terrace/cluster/block.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

int main() {
  using namespace terrace::cluster;
  std::vector<Point3> points;
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 100; ++x) {
      const double dx = 30.0 * (x - 50);
      const double dy = 30.0 * (y - 50);
      points.push_back({30.0 * x, 30.0 * y, 400.0 / (1.0 + (dx * dx + dy * dy) / 5e5)});
    }
  }

  BlockClusterer clusterer;  // keeps its memory from block to block; one per thread
  BlockClustering clustering;
  clusterer.run(points, {}, {.facility_cost = 1.0}, clustering);

  std::vector<unsigned> size(clustering.facilities.size(), 0);
  for (const std::uint32_t cluster : clustering.assignment) ++size[cluster];
  std::printf("%zu points in %zu clusters, cost %.0f m\n", points.size(), size.size(),
              clustering.cost());
  const auto largest = std::max_element(size.begin(), size.end()) - size.begin();
  const Point3& p = points[clustering.facilities[static_cast<std::size_t>(largest)]];
  std::printf("the largest has %u points around (%.0f, %.0f, %.1f)\n",
              size[static_cast<std::size_t>(largest)], p[0], p[1], p[2]);
  return size.size() > 1 ? 0 : 1;
}
