// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "inputs.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

using inputs::kInfinity;

Point3 random_point(std::mt19937_64& random, double scale) {
  // Sometimes uses a grid, so that ties and equal corners occur.
  const bool coarse = random() % 2 == 0;
  Point3 p{};
  for (double& x : p) {
    x = inputs::uniform(random) - 0.5;
    if (coarse) x = std::floor(x * 3) / 3;
    x *= scale;
  }
  return p;
}

template <std::size_t kCorners>
std::array<Point3, kCorners> random_entity(std::mt19937_64& random, double scale) {
  std::array<Point3, kCorners> entity{};
  for (Point3& p : entity) p = random_point(random, scale);
  return entity;
}

template <std::size_t kCorners, class Distance>
void expect_metric(const Distance& distance) {
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 3000; ++trial) {
    SCOPED_TRACE(testing::Message() << "trial " << trial);
    const double scale = trial % 3 == 0 ? 1.0 : trial % 3 == 1 ? 1e300 : 1e-300;
    const auto a = random_entity<kCorners>(random, scale);
    const auto b = random_entity<kCorners>(random, scale);
    const auto c = random_entity<kCorners>(random, scale);
    const double ab = distance(a, b);
    ASSERT_TRUE(ab >= 0.0 && std::isfinite(ab));
    ASSERT_EQ(distance(b, a), ab);
    ASSERT_LE(distance(a, c), (ab + distance(b, c)) * (1 + 1e-14));
    auto turned = a;
    std::rotate(turned.begin(), turned.begin() + 1, turned.end());
    ASSERT_EQ(distance(turned, a), 0.0);
    ASSERT_NEAR(distance(turned, b), ab, 1e-14 * ab);
    std::swap(turned[0], turned[1]);
    ASSERT_NEAR(distance(b, turned), ab, 1e-14 * ab);
    auto moved = a;
    for (Point3& p : moved) p[1] += scale;
    ASSERT_LE(distance(a, moved), scale * (1 + 1e-12));
  }
}

TEST(Entities, ProvidedDistancesAreMetrics) {
  expect_metric<2>(segment_distance);
  expect_metric<3>(triangle_distance);
  EXPECT_DOUBLE_EQ(segment_distance({{{0, 0, 0}, {1, 0, 0}}}, {{{1, 2, 0}, {0, 2, 0}}}), 2.0);
  EXPECT_DOUBLE_EQ(segment_distance({{{0, 0, 0}, {1, 0, 0}}}, {{{0, 0, 0}, {3, 0, 0}}}),
                   std::sqrt(2.0));
  EXPECT_DOUBLE_EQ(
      triangle_distance({{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}}, {{{0, 4, 3}, {0, 0, 3}, {4, 0, 3}}}),
      3.0);
}

// Compares with both orders of b, in extended precision.
TEST(Entities, PolylinesKeepTheOrderOfVertices) {
  std::mt19937_64 random(17);
  for (int trial = 0; trial < 3000; ++trial) {
    SCOPED_TRACE(testing::Message() << "trial " << trial);
    const std::size_t k = 1 + random() % 7;
    const double scale = trial % 3 == 0 ? 1.0 : trial % 3 == 1 ? 1e150 : 1e-150;
    std::array<std::vector<Point3>, 3> lines;
    for (auto& line : lines) {
      for (std::size_t i = 0; i < k; ++i) line.push_back(random_point(random, scale));
    }
    const std::vector<Point3>&a = lines[0], &b = lines[1], &c = lines[2];
    const auto rms_distance = [&](const auto& at) {
      long double sum = 0.0L;
      for (std::size_t i = 0; i < k; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const long double d = static_cast<long double>(a[i][axis]) - at(i)[axis];
          sum += d * d;
        }
      }
      return std::sqrt(sum / static_cast<long double>(k));
    };
    const auto expected =
        static_cast<double>(std::min(rms_distance([&](std::size_t i) { return b[i]; }),
                                     rms_distance([&](std::size_t i) { return b[k - 1 - i]; })));
    const double ab = polyline_distance(a, b);
    ASSERT_NEAR(ab, expected, 1e-14 * expected);
    ASSERT_EQ(polyline_distance(b, a), ab);
    ASSERT_LE(polyline_distance(a, c), (ab + polyline_distance(b, c)) * (1 + 1e-14));
    const std::vector<Point3> backward(a.rbegin(), a.rend());
    ASSERT_EQ(polyline_distance(backward, a), 0.0);
    ASSERT_NEAR(polyline_distance(backward, b), ab, 1e-14 * ab);
  }
  // A triangle's corners may be renumbered, but a polyline's vertices may not.
  const Triangle corners{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  const Triangle turned{{{1, 0, 0}, {0, 1, 0}, {0, 0, 0}}};
  EXPECT_EQ(triangle_distance(corners, turned), 0.0);
  EXPECT_GT(polyline_distance(corners, turned), 0.5);
}

TEST(Entities, PointsByIndexClusterLikePoints) {
  std::mt19937_64 random(9);
  const std::vector<Point3> points = inputs::cube(250, random);
  const FacilityPoints by_points{.points = points, .facility_cost = 0.5, .outlier_price = 0.2};
  const double unit = diagonal(Euclidean{}, base::box_of(points));
  const auto function = [&](std::uint32_t f, std::uint32_t c) {
    return distance(Euclidean{}, points[f], points[c]);
  };
  FacilityEntities problem{.count = points.size(), .distance = function};
  problem.facility_cost = 0.5 * unit;
  problem.outlier_price = 0.2 * unit;
  const FacilitySolution expected = solve(by_points);
  for (const bool is_metric : {false, true}) {
    problem.symmetric = problem.triangle_inequality = is_metric;
    FacilityReport report;
    const FacilitySolution solution = solve(problem, {.threads = 2}, &report);
    EXPECT_EQ(solution.facilities, expected.facilities);
    EXPECT_EQ(solution.assignment, expected.assignment);
    EXPECT_NEAR(solution.cost(), expected.cost(), 1e-12 * expected.cost());
    if (is_metric) {
      EXPECT_LT(report.search.inspected_share(), 0.9);
    }
  }
  EXPECT_NO_THROW((void)solve(problem, {.strategy = FacilityStrategy::facilities}));
  problem.triangle_inequality = false;
  EXPECT_THROW((void)solve(problem, {.strategy = FacilityStrategy::facilities}),
               std::invalid_argument);
  EXPECT_THROW((void)solve(problem, {.strategy = FacilityStrategy::kd_tree}),
               std::invalid_argument);
  EXPECT_THROW((void)solve(problem, {.strategy = FacilityStrategy::fast}), std::invalid_argument);
}

TEST(Entities, TrianglesClusterByPlaceAndShape) {
  std::mt19937_64 random(2);
  // Small triangles in two places, and large ones around both.
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i < 300; ++i) {
    Triangle t{};
    const Point3 centre{i % 3 == 1 ? 10.0 : 0.0, 0.0, 0.0};
    const double size = i % 3 == 2 ? 8.0 : 0.5;
    const std::size_t first = random() % 3;
    for (std::size_t k = 0; k < 3; ++k) {
      const double angle = 2.0943951023931953 * static_cast<double>((first + k) % 3);
      t[k] = {centre[0] + size * std::cos(angle) + 0.2 * inputs::uniform(random),
              centre[1] + size * std::sin(angle) + 0.2 * inputs::uniform(random), 0.0};
    }
    triangles.push_back(t);
  }
  FacilityEntities problem;
  problem.count = triangles.size();
  problem.distance = [&](std::uint32_t f, std::uint32_t c) {
    return triangle_distance(triangles[f], triangles[c]);
  };
  problem.symmetric = problem.triangle_inequality = true;
  problem.facility_cost = 20.0;
  const FacilitySolution solution =
      solve(problem, {.effort = Effort::fine, .assign_nearest = true});
  ASSERT_EQ(solution.facilities.size(), 3u);
  for (std::size_t i = 3; i < triangles.size(); ++i) {
    EXPECT_EQ(solution.assignment[i], solution.assignment[i % 3]);
  }
}

// Returns the Levenshtein distance, which is a metric.
double edits(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0u : 1u);
      diagonal = std::exchange(row[j], std::min({replaced, row[j] + 1, row[j - 1] + 1}));
    }
  }
  return static_cast<double>(row[b.size()]);
}

TEST(Entities, WordsClusterByEdits) {
  const std::vector<std::string> words{"terrain",  "terrains", "terrane",   "terain",
                                       "cluster",  "clusters", "clutter",   "bluster",
                                       "facility", "faculty",  "facilities"};
  FacilityEntities problem;
  problem.count = words.size();
  problem.distance = [&](std::uint32_t f, std::uint32_t c) { return edits(words[f], words[c]); };
  problem.symmetric = problem.triangle_inequality = true;
  problem.facility_cost = 6.0;
  const FacilitySolution solution = solve(problem, {.steps = 200, .assign_nearest = true});
  ASSERT_EQ(solution.facilities.size(), 3u);
  const auto cluster = [&](std::size_t word) { return solution.assignment[word]; };
  for (const std::size_t i : {1u, 2u, 3u}) EXPECT_EQ(cluster(i), cluster(0));
  for (const std::size_t i : {5u, 6u, 7u}) EXPECT_EQ(cluster(i), cluster(4));
  for (const std::size_t i : {9u, 10u}) EXPECT_EQ(cluster(i), cluster(8));
  problem.outlier_price = 1.5;
  const FacilitySolution fewer = solve(problem, {.steps = 200});
  EXPECT_GT(std::count(fewer.assignment.begin(), fewer.assignment.end(), kOutlier), 0);
  EXPECT_LT(fewer.cost(), solution.cost());
}

TEST(Entities, NamesBadInput) {
  const auto zero = [](std::uint32_t, std::uint32_t) { return 0.0; };
  const auto message = [](const FacilityEntities& problem, unsigned threads = 1) -> std::string {
    try {
      (void)solve(problem, {.threads = threads});
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message({.distance = zero}), "");
  EXPECT_NE(message({.count = 3}), "");
  EXPECT_EQ(message({.count = 3, .distance = zero}), "");
  const std::vector<double> weights{1.0, 0.0, 1.0};
  EXPECT_NE(message({.count = 3, .distance = zero, .weights = weights}).find("entity 1"),
            std::string::npos);
  EXPECT_NE(message({.count = 2, .distance = zero, .weights = weights}), "");
  EXPECT_NE(message({.count = 3, .distance = zero, .facility_cost = 0.0}), "");
  EXPECT_NE(message({.count = 3, .distance = zero, .facility_cost = kInfinity}), "");
  EXPECT_NE(message({.count = 3, .distance = zero, .outlier_price = -1.0}), "");
  for (const double bad : {-1.0, kInfinity, std::numeric_limits<double>::quiet_NaN()}) {
    for (const unsigned threads : {1u, 3u}) {
      const auto one_bad = [bad](std::uint32_t f, std::uint32_t c) {
        return f != c && c == 150 ? bad : std::abs(static_cast<double>(f) - static_cast<double>(c));
      };
      const std::string text = message({.count = 200, .distance = one_bad}, threads);
      EXPECT_NE(text.find("client 150"), std::string::npos) << text;
    }
  }
}

}  // namespace
}  // namespace terrace::cluster
