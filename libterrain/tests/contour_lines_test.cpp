// SPDX-License-Identifier: Apache-2.0 Checks contour lines of random lattices with plateaus and
// holes. Each crossing of an edge by a level must be on one line, lines must end only at borders,
// and bands must not matter.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "contour/lines.hpp"

namespace terrace::terrain {
namespace {

constexpr std::int64_t kColumns = 23, kRows = 31;

std::vector<double> random_lattice(std::uint64_t seed, int heights, int holes) {
  std::mt19937_64 random(seed);
  std::vector<double> lattice;
  for (std::int64_t i = 0; i < kColumns * kRows; ++i) {
    const auto height = static_cast<double>(random() % static_cast<std::uint64_t>(heights));
    const bool hole = holes > 0 && random() % static_cast<std::uint64_t>(holes) == 0;
    lattice.push_back(hole ? NAN : height);
  }
  return lattice;
}

struct Drawn {
  std::vector<ContourLine> lines;
  std::uint64_t segments = 0, open_points = 0;
};

Drawn draw(const std::vector<double>& lattice, double interval, std::int64_t band,
           unsigned threads = 1) {
  Drawn drawn;
  ContourLines lines(
      kColumns, interval, [&](const ContourLine& line) { drawn.lines.push_back(line); }, {},
      threads);
  for (std::int64_t row = 0; row + 1 < kRows; row += band) {
    const std::int64_t rows = std::min(band + 1, kRows - row);
    lines.add(std::span(lattice).subspan(static_cast<std::size_t>(row * kColumns),
                                         static_cast<std::size_t>(rows * kColumns)),
              rows);
  }
  lines.finish();
  drawn.segments = lines.segments();
  drawn.open_points = lines.open_points();
  return drawn;
}

using Edge = std::pair<std::int64_t, std::int64_t>;

/// Returns the number of triangles at each edge, by the rule of lattice_surface.hpp.
std::map<Edge, int> edges_of(const std::vector<double>& lattice) {
  std::map<Edge, int> edges;
  const auto add = [&](std::int64_t a, std::int64_t b, std::int64_t c) {
    for (const auto& [p, q] : {Edge{a, b}, Edge{b, c}, Edge{a, c}}) {
      ++edges[{std::min(p, q), std::max(p, q)}];
    }
  };
  for (std::int64_t row = 0; row + 1 < kRows; ++row) {
    for (std::int64_t column = 0; column + 1 < kColumns; ++column) {
      const std::int64_t at = row * kColumns + column;
      std::vector<std::int64_t> with;
      for (const std::int64_t corner : {at, at + 1, at + kColumns, at + kColumns + 1}) {
        if (!std::isnan(lattice[static_cast<std::size_t>(corner)])) with.push_back(corner);
      }
      if (with.size() == 3) add(with[0], with[1], with[2]);
      if (with.size() == 4) {
        add(with[0], with[1], with[2]);
        add(with[1], with[2], with[3]);
      }
    }
  }
  return edges;
}

TEST(ContourLines, KeepOrderForAnyBandSize) {
  const std::vector<double> lattice = random_lattice(7, 40, 9);
  const Drawn large = draw(lattice, 5, 256), small = draw(lattice, 5, 2);
  ASSERT_EQ(large.lines.size(), small.lines.size());
  for (std::size_t i = 0; i < large.lines.size(); ++i) {
    EXPECT_EQ(large.lines[i].points, small.lines[i].points);
  }
}

TEST(ContourLines, DoNotDependOnThreads) {
  const std::vector<double> lattice = random_lattice(7, 40, 9);
  const Drawn one = draw(lattice, 5, 10), several = draw(lattice, 5, 10, 4);
  ASSERT_GT(one.lines.size(), 10u);
  ASSERT_EQ(one.lines.size(), several.lines.size());
  for (std::size_t i = 0; i < one.lines.size(); ++i) {
    EXPECT_EQ(one.lines[i].level, several.lines[i].level);
    EXPECT_EQ(one.lines[i].points, several.lines[i].points);
  }
  EXPECT_EQ(one.segments, several.segments);
}

TEST(ContourLines, CrossEveryStraddlingEdgeAndEndOnlyAtBorders) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    auto lattice = random_lattice(seed, seed % 3 == 0 ? 3 : 40, static_cast<int>(seed % 4) * 5);
    const double interval = seed % 2 == 0 ? 1 : 3.5;
    if (seed % 2 == 1) {
      // No sample is at a level.
      for (double& height : lattice) height += 0.25;
    }
    const Drawn drawn = draw(lattice, interval, kRows);
    std::uint64_t sides = 0, ends = 0;
    for (const auto& [edge, triangles] : edges_of(lattice)) {
      const double a = lattice[static_cast<std::size_t>(edge.first)];
      const double b = lattice[static_cast<std::size_t>(edge.second)];
      for (double level = 0; level <= 45; level += interval) {
        if ((a > level) == (b > level)) continue;
        sides += static_cast<std::uint64_t>(triangles);
        if (triangles == 1) ++ends;
      }
    }
    EXPECT_EQ(2 * drawn.segments, sides);
    EXPECT_EQ(drawn.open_points, 0u);
    std::uint64_t open = 0;
    for (const ContourLine& line : drawn.lines) {
      if (line.closed) {
        EXPECT_EQ(line.points.front(), line.points.back());
      } else {
        ++open;
      }
    }
    // Where samples are at levels, lines may shrink to points, which are not written.
    EXPECT_LE(2 * open, ends);
    if (seed % 2 == 1) {
      EXPECT_EQ(2 * open, ends);
    }
  }
}

TEST(ContourLines, DoNotDependOnBands) {
  for (std::uint64_t seed = 31; seed <= 45; ++seed) {
    SCOPED_TRACE(seed);
    const auto lattice = random_lattice(seed, 12, 9);
    using Key = std::tuple<std::int64_t, std::size_t, std::set<Point2>>;
    const auto lines_of = [&](std::int64_t band) {
      std::vector<Key> keys;
      for (const ContourLine& line : draw(lattice, 2, band).lines) {
        keys.emplace_back(line.level, line.points.size(),
                          std::set<Point2>(line.points.begin(), line.points.end()));
      }
      std::sort(keys.begin(), keys.end());
      return keys;
    };
    const auto whole = lines_of(kRows);
    EXPECT_FALSE(whole.empty());
    for (const std::int64_t band : {1, 2, 7}) EXPECT_EQ(lines_of(band), whole) << band;
  }
}

TEST(ContourLines, DrawPlateauOnUpperSideAndCraterAsOneRing) {
  // A plateau at a level counts as below it, so the line is where the ground rises from it.
  std::vector<double> lattice(kColumns * kRows, 10);
  for (std::int64_t row = 0; row < kRows; ++row) {
    for (std::int64_t column = 12; column < kColumns; ++column) {
      lattice[static_cast<std::size_t>(row * kColumns + column)] = 14;
    }
  }
  const Drawn step = draw(lattice, 10, 4);
  ASSERT_EQ(step.lines.size(), 1u);
  for (const Point2& p : step.lines[0].points) EXPECT_EQ(p[0], 11);
  std::vector<double> crater(kColumns * kRows, 5);
  crater[static_cast<std::size_t>(9 * kColumns + 9)] = -5;
  const Drawn ring = draw(crater, 10, 3);
  ASSERT_EQ(ring.lines.size(), 1u);
  EXPECT_TRUE(ring.lines[0].closed);
  EXPECT_EQ(ring.lines[0].points.size(), 7u);
  EXPECT_TRUE(draw(std::vector<double>(kColumns * kRows, 10), 10, 5).lines.empty());
  EXPECT_TRUE(draw(std::vector<double>(kColumns * kRows, NAN), 10, 5).lines.empty());
}

}  // namespace
}  // namespace terrace::terrain
