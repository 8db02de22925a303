// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/point_spacing.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace terrace::tools {

using namespace terrain;
namespace {

using Points = std::vector<stream::Point3>;

std::vector<float> brute_force(const Points& points, unsigned rank) {
  std::vector<float> result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::vector<double> squares;
    for (std::size_t j = 0; j < points.size(); ++j) {
      if (i == j) continue;
      double square = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        square += (points[i][k] - points[j][k]) * (points[i][k] - points[j][k]);
      }
      squares.push_back(square);
    }
    std::sort(squares.begin(), squares.end());
    const std::size_t at = std::min<std::size_t>(rank, squares.size());
    result.push_back(at == 0 ? 0.0F : static_cast<float>(std::sqrt(squares[at - 1])));
  }
  return result;
}

TEST(NeighbourDistances, MatchTheMinimumOverAllPairs) {
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    Points points(random() % 300);
    // Small integers make many distances and many points equal; some sets are on a line or a plane.
    for (stream::Point3& p : points) {
      for (std::size_t k = 0; k < 1 + seed % 3; ++k) {
        p[k] = static_cast<double>(random() % (seed % 2 == 0 ? 6 : 1000));
      }
    }
    for (const unsigned rank : {1U, 3U, 8U, 32U}) {
      const std::vector<float> expected = brute_force(points, rank);
      EXPECT_EQ(neighbour_distances(points, rank, 1), expected);
      EXPECT_EQ(neighbour_distances(points, rank, 3), expected);
    }
  }
}

TEST(NeighbourDistances, AreZeroForOnePointAndForEqualPoints) {
  EXPECT_EQ(neighbour_distances(Points{}, 4, 2), std::vector<float>());
  EXPECT_EQ(neighbour_distances(Points(1), 4, 2), std::vector<float>(1, 0.0F));
  EXPECT_EQ(neighbour_distances(Points(1000, {1, 2, 3}), 4, 2), std::vector<float>(1000, 0.0F));
}

}  // namespace
}  // namespace terrace::tools
