// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "grid_windows.hpp"
#include "terrace/tri/grid_tin.hpp"

namespace {

using namespace terrace::tri;
using Line = std::vector<double>;

std::vector<std::uint32_t> settle(const Line& line, const Line& neighbour_line, const Line& other,
                                  double bound) {
  return settle_side<double>(line, neighbour_line, other, bound);
}

TEST(SettleSide, KeepsOnlyTheEndsOfStraightLines) {
  EXPECT_EQ(settle({1, 2, 3, 4}, {}, {}, 0), (std::vector<std::uint32_t>{0, 3}));
  EXPECT_EQ(settle({5}, {}, {}, 0), (std::vector<std::uint32_t>{0}));
  EXPECT_EQ(settle({5, 9}, {}, {}, 0), (std::vector<std::uint32_t>{0, 1}));
  EXPECT_TRUE(settle({}, {}, {}, 0).empty());
  EXPECT_EQ(settle({kNoHeight, kNoHeight, kNoHeight, kNoHeight}, {}, {}, 0),
            (std::vector<std::uint32_t>{0, 3}));
}

TEST(SettleSide, InsertsTheGreatestErrorFirst) {
  EXPECT_EQ(settle({0, 3, 10, 3, 0}, {}, {}, 2.5), (std::vector<std::uint32_t>{0, 2, 4}));
  EXPECT_EQ(settle({0, 3, 10, 3, 0}, {}, {}, 1.5), (std::vector<std::uint32_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(settle({0, 3, 10, 3, 0}, {}, {}, 10.5), (std::vector<std::uint32_t>{0, 4}));
}

TEST(SettleSide, EndsDataAtVertices) {
  EXPECT_EQ(settle({0, 0, 0, kNoHeight, kNoHeight, kNoHeight, 0, 0, 0, 0}, {}, {}, 1),
            (std::vector<std::uint32_t>{0, 2, 3, 5, 6, 9}));
}

TEST(SettleSide, NeighbouringMissingDataMakesVertices) {
  const Line line(7, 1.0);
  Line neighbour_line = line;
  neighbour_line[3] = kNoHeight;
  const std::vector<std::uint32_t> expected{0, 2, 3, 4, 6};
  EXPECT_EQ(settle(line, neighbour_line, {}, 1), expected);
  EXPECT_EQ(settle(line, {}, neighbour_line, 1), expected);
  EXPECT_EQ(settle(line, neighbour_line, line, 1), settle(line, line, neighbour_line, 1));
}

TEST(SettleSide, KeepsTheBound) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    Line line;
    const std::size_t count = 1 + random() % 80;
    const bool gaps = seed % 3 == 0;
    double z = 0;
    for (std::size_t i = 0; i < count; ++i) {
      z += static_cast<double>(random() % 21) - 10;
      line.push_back(gaps && random() % 10 == 0 ? kNoHeight : z);
    }
    const double bound = static_cast<double>(random() % 30);
    const auto vertices = settle(line, {}, {}, bound);
    ASSERT_EQ(vertices.front(), 0U);
    ASSERT_EQ(vertices.back(), count - 1);
    for (std::size_t k = 1; k < vertices.size(); ++k) {
      const std::uint32_t a = vertices[k - 1], b = vertices[k];
      ASSERT_LT(a, b);
      const bool has = std::isfinite(line[a]) && std::isfinite(line[b]);
      for (std::uint32_t i = a + 1; i < b; ++i) {
        ASSERT_EQ(std::isfinite(line[i]), has);
        if (!has) continue;
        const double interpolated = line[a] + (line[b] - line[a]) * (i - a) / (b - a);
        EXPECT_LE(std::fabs(line[i] - interpolated), bound);
      }
    }
  }
}

TEST(SettleSide, RejectsInvalidArguments) {
  EXPECT_THROW(settle({1, 2, 3}, {1, 2}, {}, 1), std::invalid_argument);
  EXPECT_THROW(settle({1, 2, 3}, {}, {1, 2, 3, 4}, 1), std::invalid_argument);
  EXPECT_THROW(settle({1, 2, 3}, {}, {}, -1), std::invalid_argument);
  EXPECT_THROW(settle({1, 2, 3}, {}, {}, kNoHeight), std::invalid_argument);
  EXPECT_THROW(settle({1, 1e151}, {}, {}, 1), std::invalid_argument);
}

}  // namespace
