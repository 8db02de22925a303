// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/matching_tree.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "matching_oracles.hpp"
#include "terrace/matching/point_matching.hpp"

namespace terrace::matching {
namespace {

using oracles::uniform;

template <class Point>
std::vector<Point> uniform_points(std::size_t n, std::mt19937_64& random) {
  std::vector<Point> points(n);
  for (Point& p : points) {
    for (double& c : p) c = uniform(random);
  }
  return points;
}

template <class Point>
MatchingTree<Point> tree_of(const std::vector<Point>& points,
                            const MatchingTreeOptions<Point>& options = {}) {
  return make_matching_tree(std::span<const Point>(points), options);
}

template <class Point>
double least_cost(const std::vector<Point>& points) {
  return points.size() <= 12 ? oracles::point_optimum(points)
                             : match_points(std::span<const Point>(points)).cost;
}

/// Checks everything that does not depend on clusters: sizes, positions, and that each level is
/// matched at the least cost. The nodes of each level are derived from the rows alone. `nodes` is
/// the first level.
template <class Point>
void expect_levels_optimal(const MatchingTree<Point>& tree, const std::vector<Point>& points,
                           std::vector<std::uint32_t> nodes, std::uint32_t first,
                           std::uint32_t last, double unit) {
  const auto n = static_cast<std::uint32_t>(points.size());
  const auto position = [&](std::uint32_t v) { return v < n ? points[v] : tree.positions[v - n]; };
  std::uint32_t row = first;
  while (row < last) {
    const std::uint32_t level = tree.rows[row].level;
    SCOPED_TRACE(testing::Message() << "level " << level);
    std::vector<Point> present;
    for (const std::uint32_t v : nodes) present.push_back(position(v));
    for (Point& p : present) {
      for (double& c : p) c /= unit;
    }
    double cost = 0.0;
    const std::size_t pairs = nodes.size() / 2;
    for (std::size_t k = 0; k < pairs; ++k, ++row) {
      ASSERT_LT(row, last);
      const MatchingTreeRow& r = tree.rows[row];
      EXPECT_EQ(r.level, level);
      EXPECT_LT(r.a, r.b);
      EXPECT_EQ(std::erase(nodes, r.a), 1u);
      EXPECT_EQ(std::erase(nodes, r.b), 1u);
      EXPECT_NEAR(r.distance / unit, oracles::distance(position(r.a), position(r.b)) / unit, 1e-12);
      cost += r.distance / unit;
    }
    EXPECT_LE(nodes.size(), 1u);
    for (std::size_t k = 0; k < pairs; ++k) {
      nodes.push_back(n + row - static_cast<std::uint32_t>(pairs - k));
    }
    EXPECT_NEAR(cost, least_cost(present), 1e-10 * (1.0 + cost));
  }
  EXPECT_EQ(nodes.size(), 1u);
}

/// Checks that every leaf occurs once, that children come before parents and have lower levels,
/// that sizes add up, and that positions are means.
template <class Point>
void expect_tree(const MatchingTree<Point>& tree, const std::vector<Point>& points,
                 std::span<const double> weights = {}, double unit = 1.0) {
  const std::size_t n = points.size();
  ASSERT_EQ(tree.rows.size(), n == 0 ? 0 : n - 1);
  ASSERT_EQ(tree.positions.size(), tree.rows.size());
  if (n == 0) {
    EXPECT_EQ(tree.root, kNone);
    return;
  }
  EXPECT_EQ(tree.root, n == 1 ? 0 : 2 * n - 2);
  std::vector<double> weight(2 * n - 1, 1.0);
  std::vector<Point> sum(2 * n - 1);
  std::vector<unsigned> parents(2 * n - 1, 0);
  for (std::size_t i = 0; i < n; ++i) {
    if (!weights.empty()) weight[i] = weights[i];
    for (std::size_t d = 0; d < points[i].size(); ++d)
      sum[i][d] = weight[i] * (points[i][d] / unit);
  }
  for (std::size_t r = 0; r + 1 < n; ++r) {
    const auto [a, b, distance, size, level] = tree.rows[r];
    ASSERT_LT(a, b);
    ASSERT_LT(b, n + r);
    ++parents[a];
    ++parents[b];
    const auto size_of = [&](std::uint32_t v) { return v < n ? 1 : tree.rows[v - n].size; };
    const auto level_of = [&](std::uint32_t v) { return v < n ? 0 : tree.rows[v - n].level; };
    EXPECT_EQ(size, size_of(a) + size_of(b));
    EXPECT_GT(level, std::max(level_of(a), level_of(b)));
    EXPECT_GE(distance, 0.0);
    weight[n + r] = weight[a] + weight[b];
    for (std::size_t d = 0; d < sum[a].size(); ++d) {
      sum[n + r][d] = sum[a][d] + sum[b][d];
      EXPECT_NEAR(tree.positions[r][d] / unit, sum[n + r][d] / weight[n + r], 1e-11);
    }
  }
  for (std::size_t v = 0; v < parents.size(); ++v) EXPECT_EQ(parents[v], v == tree.root ? 0u : 1u);
}

template <class Point>
std::vector<std::uint32_t> all_of(const std::vector<Point>& points) {
  std::vector<std::uint32_t> nodes(points.size());
  for (std::uint32_t i = 0; i < nodes.size(); ++i) nodes[i] = i;
  return nodes;
}

template <class Point>
void expect_all(const std::vector<Point>& points, double unit = 1.0) {
  const MatchingTree<Point> tree = tree_of(points);
  expect_tree(tree, points, {}, unit);
  if (points.empty()) return;
  const auto rows = static_cast<std::uint32_t>(tree.rows.size());
  expect_levels_optimal(tree, points, all_of(points), 0, rows, unit);
  if (rows > 0) {
    EXPECT_EQ(tree.rows.back().level, std::bit_width(rows));
  }
}

TEST(MatchingTree, MatchesEachLevelAtTheLeastCost) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::size_t n = seed <= 40 ? random() % 13 : 100 + random() % 300;
    auto flat = uniform_points<Point2>(n, random);
    // Every second seed uses small integers, for ties and duplicates.
    if (seed % 2 == 0) {
      for (Point2& p : flat) p = {std::floor(4 * p[0]), std::floor(4 * p[1])};
    }
    expect_all(flat);
    expect_all(uniform_points<Point3>(n, random));
  }
}

TEST(MatchingTree, HandlesLinesEqualPointsAndGrids) {
  std::mt19937_64 random(7);
  std::vector<Point2> line(101), equal(77, Point2{0.1, -0.7}), grid;
  for (Point2& p : line) p = {uniform(random), 0.3};
  for (std::size_t k = 0; k < 13 * 13; ++k) {
    grid.push_back({static_cast<double>(k % 13), static_cast<double>(k / 13)});
  }
  expect_all(line);
  expect_all(equal);
  expect_all(grid);
  for (const MatchingTreeRow& row : tree_of(equal).rows) EXPECT_EQ(row.distance, 0.0);
  for (const Point2& p : tree_of(equal).positions) EXPECT_EQ(p, equal[0]);
}

TEST(MatchingTree, HandlesHugeAndTinyCoordinates) {
  for (const double unit : {1e300, 1e-300, 1e155, 1e-160}) {
    SCOPED_TRACE(testing::Message() << "unit " << unit);
    std::mt19937_64 random(3);
    auto points = uniform_points<Point3>(90, random);
    for (Point3& p : points) {
      for (double& c : p) c *= unit;
    }
    const MatchingTree<Point3> tree = tree_of(points);
    expect_tree(tree, points, {}, unit);
    for (std::size_t r = 0; r < tree.rows.size(); ++r) {
      EXPECT_GT(tree.rows[r].distance / unit, 1e-6);
      EXPECT_LT(tree.rows[r].distance / unit, 2.0);
    }
  }
  const std::vector<Point2> ends{{-1.7e308, 0.0}, {1.7e308, 0.0}};
  EXPECT_THROW(tree_of(ends), std::invalid_argument);
}

TEST(MatchingTree, PutsPairsAtTheirWeightedMidpoints) {
  std::mt19937_64 random(11);
  const auto points = uniform_points<Point2>(64, random);
  std::vector<double> weights(points.size());
  for (double& w : weights) w = 0.01 + 100.0 * uniform(random);
  MatchingTreeOptions<Point2> options;
  options.weights = weights;
  expect_tree(tree_of(points, options), points, weights);
  // Only the ratios of the weights matter.
  const MatchingTree<Point2> tree = tree_of(points, options);
  std::vector<double> scaled = weights;
  for (double& w : scaled) w *= 0x1p900;
  options.weights = scaled;
  EXPECT_EQ(tree_of(points, options).rows, tree.rows);
  EXPECT_EQ(tree_of(points, options).positions, tree.positions);
}

TEST(MatchingTree, MatchesWithinClustersThenBetweenThem) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const auto points = uniform_points<Point3>(400, random);
    const auto n = static_cast<std::uint32_t>(points.size());
    // Dense labels, labels with gaps, labels beyond the number of points, and one label per point.
    std::vector<std::uint32_t> labels(n);
    for (std::uint32_t i = 0; i < n; ++i) {
      const auto drawn = static_cast<std::uint32_t>(random() % 9);
      labels[i] = seed % 4 == 0 ? drawn : seed % 4 == 1 ? 7 * drawn : drawn * 400000000u;
      if (seed == 3) labels[i] = i;
    }
    MatchingTreeOptions<Point3> options;
    options.labels = labels;
    const MatchingTree<Point3> tree = tree_of(points, options);
    expect_tree(tree, points);
    std::map<std::uint32_t, std::vector<std::uint32_t>> clusters;
    for (std::uint32_t i = 0; i < n; ++i) clusters[labels[i]].push_back(i);
    std::uint32_t row = 0, highest = 0;
    std::vector<std::uint32_t> roots;
    for (const auto& [label, members] : clusters) {
      const auto last = row + static_cast<std::uint32_t>(members.size()) - 1;
      expect_levels_optimal(tree, points, members, row, last, 1.0);
      if (row < last) {
        EXPECT_EQ(tree.rows[row].level, 1u);
      }
      for (std::uint32_t r = row + 1; r < last; ++r) {
        EXPECT_LE(tree.rows[r - 1].level, tree.rows[r].level);
      }
      roots.push_back(members.size() == 1 ? members[0] : n + last - 1);
      highest = std::max(highest, static_cast<std::uint32_t>(std::bit_width(members.size() - 1)));
      row = last;
    }
    expect_levels_optimal(tree, points, roots, row, n - 1, 1.0);
    EXPECT_EQ(tree.rows[row].level, highest + 1);
  }
}

TEST(MatchingTree, DoesNotDependOnThreads) {
  std::mt19937_64 random(5);
  const auto points = uniform_points<Point2>(3000, random);
  std::vector<std::uint32_t> labels;
  for (const Point2& p : points) labels.push_back(static_cast<std::uint32_t>(40 * p[0] * p[0]));
  MatchingTreeOptions<Point2> options;
  options.labels = labels;
  const MatchingTree<Point2> one = tree_of(points, options);
  for (const unsigned threads : {0u, 2u, 3u, 100u}) {
    SCOPED_TRACE(testing::Message() << threads << " threads");
    options.threads = threads;
    const MatchingTree<Point2> more = tree_of(points, options);
    EXPECT_EQ(more.rows, one.rows);
    EXPECT_EQ(more.positions, one.positions);
    EXPECT_EQ(more.root, one.root);
  }
}

TEST(MatchingTree, ReportsProgressAndStops) {
  std::mt19937_64 random(5);
  const auto points = uniform_points<Point2>(200, random);
  std::vector<std::uint32_t> labels;
  for (std::uint32_t i = 0; i < 200; ++i) labels.push_back(i % 10);
  for (const unsigned threads : {1u, 2u}) {
    MatchingTreeOptions<Point2> options;
    options.labels = labels;
    options.threads = threads;
    std::vector<std::size_t> reports;
    options.progress = [&](std::size_t done, std::size_t total) {
      EXPECT_EQ(total, 199u);
      reports.push_back(done);
      return true;
    };
    EXPECT_EQ(tree_of(points, options).rows.size(), 199u);
    ASSERT_FALSE(reports.empty());
    EXPECT_TRUE(std::is_sorted(reports.begin(), reports.end()));
    EXPECT_EQ(reports.back(), 199u);
    std::size_t calls = 0;
    // The caller's thread reports at least the last levels, so the work stops before the end.
    options.progress = [&](std::size_t, std::size_t) { return ++calls < 2; };
    const MatchingTree<Point2> stopped = tree_of(points, options);
    EXPECT_EQ(calls, 2u);
    EXPECT_TRUE(stopped.rows.empty());
    EXPECT_TRUE(stopped.positions.empty());
    EXPECT_EQ(stopped.root, kNone);
  }
}

TEST(MatchingTree, UsesTheCallersMatcher) {
  std::mt19937_64 random(5);
  const auto points = uniform_points<Point2>(37, random);
  MatchingTreeOptions<Point2> options;
  // Pairs neighbours in the given order. The last node is left over.
  options.matcher = [](std::span<const Point2> present) {
    std::vector<std::uint32_t> mate(present.size());
    for (std::uint32_t i = 0; i < mate.size(); ++i) mate[i] = i ^ 1u;
    if (mate.size() % 2 == 1) mate.back() = kNone;
    return mate;
  };
  const MatchingTree<Point2> tree = tree_of(points, options);
  expect_tree(tree, points);
  EXPECT_EQ(tree.rows[0].b, 1u);
  EXPECT_EQ(tree.rows[18].a, 37u);
  const auto expect_refused = [&](std::vector<std::uint32_t> mate, const std::string& what) {
    options.matcher = [mate](std::span<const Point2>) { return mate; };
    const std::vector<Point2> three{{0, 0}, {1, 0}, {2, 0}};
    try {
      (void)tree_of(three, options);
      ADD_FAILURE() << "taken";
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
    }
  };
  expect_refused({1, 0}, "2 partners for 3");
  expect_refused({1, 2, 0}, "node 0");
  expect_refused({1, 0, 2}, "node 2");
  expect_refused({1, 0, 3}, "node 2");
  expect_refused({kNone, kNone, kNone}, "node 1");
  options.matcher = [](std::span<const Point2>) -> std::vector<std::uint32_t> {
    throw std::runtime_error("matcher");
  };
  EXPECT_THROW(tree_of(points, options), std::runtime_error);
}

template <class Point>
std::string refusal(std::span<const Point> points, const MatchingTreeOptions<Point>& options = {}) {
  try {
    (void)make_matching_tree(points, options);
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "taken";
}

TEST(MatchingTree, RefusesBadInput) {
  std::vector<Point3> points(5);
  const auto refuse = [&](const MatchingTreeOptions<Point3>& options, const char* what) {
    const std::string text = refusal(std::span<const Point3>(points), options);
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  points[3][2] = std::numeric_limits<double>::quiet_NaN();
  refuse({}, "point 3 is not finite");
  points[3][2] = std::numeric_limits<double>::infinity();
  refuse({}, "point 3 is not finite");
  points[3][2] = 0.0;
  MatchingTreeOptions<Point3> options;
  const std::vector<std::uint32_t> labels(4, 0);
  options.labels = labels;
  refuse(options, "4 labels for 5 points");
  options.labels = {};
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity()}) {
    std::vector<double> weights(5, 1.0);
    weights[4] = bad;
    options.weights = weights;
    refuse(options, "weight of point 4");
  }
  const std::vector<double> short_weights(3, 1.0), heavy(5, 1e308);
  options.weights = short_weights;
  refuse(options, "3 weights for 5 points");
  options.weights = heavy;
  refuse(options, "sum overflows a double");
  // The size is checked before anything is read.
  const std::span<const Point3> too_many(points.data(), std::size_t{1} << 31);
  EXPECT_NE(refusal(too_many).find("MiB"), std::string::npos);
}

}  // namespace
}  // namespace terrace::matching
