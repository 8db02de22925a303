// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/point_assignment.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "assignment_oracle.hpp"

namespace terrace::matching {
namespace {

template <class Point, class Draw>
std::vector<Point> draw_points(std::size_t count, const Draw& draw) {
  std::vector<Point> points(count);
  for (Point& p : points) {
    for (double& x : p) x = draw();
  }
  return points;
}

template <class Point>
std::vector<double> matrix(const std::vector<Point>& rows, const std::vector<Point>& columns) {
  std::vector<double> costs;
  for (const Point& r : rows) {
    for (const Point& c : columns) {
      double sum = 0;
      for (std::size_t d = 0; d < r.size(); ++d) sum += (r[d] - c[d]) * (r[d] - c[d]);
      costs.push_back(std::sqrt(sum));
    }
  }
  return costs;
}

template <class Point>
class AssignPointsTyped : public testing::Test {};
using PointTypes = testing::Types<Point2, Point3>;
TYPED_TEST_SUITE(AssignPointsTyped, PointTypes);

// Uniform points, and a few grid places used many times over, so that most distances tie.
TYPED_TEST(AssignPointsTyped, EqualsTheMatrix) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    std::mt19937_64 random(seed);
    const std::size_t r = 1 + random() % 150, c = 1 + random() % 150;
    const std::uint64_t places = seed % 3 == 0 ? 3 : seed % 3 == 1 ? 10 : std::uint64_t{1} << 40;
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << r << " x " << c);
    const auto draw = [&] { return static_cast<double>(random() % places); };
    const auto rows = draw_points<TypeParam>(r, draw), columns = draw_points<TypeParam>(c, draw);
    const double tolerance = 1e-12 * static_cast<double>(places) * 150;
    const Assignment a = assign_points(rows, columns);
    EXPECT_LE(check_points(a, rows, columns), tolerance);
    const std::vector<double> costs = matrix(rows, columns);
    EXPECT_LE(check(a, costs, r, c), tolerance);
    EXPECT_NEAR(a.cost, assign(costs, r, c).cost, tolerance);
  }
}

TYPED_TEST(AssignPointsTyped, EqualsBruteForce) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const auto draw = [&] { return uniform(random); };
    const std::size_t r = 1 + random() % 6, c = 1 + random() % 6;
    const auto rows = draw_points<TypeParam>(r, draw), columns = draw_points<TypeParam>(c, draw);
    EXPECT_NEAR(assign_points(rows, columns).cost, brute_force(matrix(rows, columns), r, c), 1e-14);
  }
}

TYPED_TEST(AssignPointsTyped, HandlesManyEqualPoints) {
  const std::vector<TypeParam> rows(20000), columns(20000);
  const Assignment a = assign_points(rows, columns);
  EXPECT_EQ(a.cost, 0);
  std::vector<bool> used(columns.size(), false);
  for (const std::uint32_t j : a.column) {
    EXPECT_FALSE(used[j]);
    used[j] = true;
  }
}

// All rows are on one side of all columns, far from every candidate.
TYPED_TEST(AssignPointsTyped, HandlesDistantSetsOfDifferentSizes) {
  for (const std::size_t r : {120u, 60u, 200u}) {
    std::mt19937_64 random(r);
    const auto near = [&] { return uniform(random); };
    const auto far = [&] { return 50 + uniform(random) * uniform(random); };
    const auto rows = draw_points<TypeParam>(r, near), columns = draw_points<TypeParam>(120, far);
    EXPECT_LE(check_points(assign_points(rows, columns), rows, columns), 1e-11);
  }
}

TYPED_TEST(AssignPointsTyped, HandlesLinesAndExtremeCoordinates) {
  for (const double scale : {1e-300, 1e-160, 1e160, 1e300}) {
    SCOPED_TRACE(testing::Message() << "scale " << scale);
    std::mt19937_64 random(2);
    const auto draw = [&] { return (2 * uniform(random) - 1) * scale; };
    auto rows = draw_points<TypeParam>(100, draw), columns = draw_points<TypeParam>(110, draw);
    EXPECT_LE(check_points(assign_points(rows, columns), rows, columns), 1e-12 * scale);
    for (auto* points : {&rows, &columns}) {
      for (auto& p : *points) p.fill(p[0]);
    }
    EXPECT_LE(check_points(assign_points(rows, columns), rows, columns), 1e-12 * scale);
  }
}

TYPED_TEST(AssignPointsTyped, AcceptsEmptySetsAndSinglePoints) {
  const std::vector<TypeParam> none, one(1), two(2);
  EXPECT_TRUE(assign_points(none, none).column.empty());
  EXPECT_TRUE(assign_points(none, one).column.empty());
  EXPECT_EQ(assign_points(one, none).column, std::vector<std::uint32_t>{kUnassigned});
  EXPECT_EQ(assign_points(one, two).cost, 0);
  EXPECT_EQ(check_points(assign_points(two, one), two, one), 0);
}

TYPED_TEST(AssignPointsTyped, NamesABadPoint) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -1e301}) {
    std::vector<TypeParam> good(4), spoiled(4);
    spoiled[3][1] = bad;
    for (const bool row : {true, false}) {
      try {
        assign_points(row ? spoiled : good, row ? good : spoiled);
        FAIL() << "no error";
      } catch (const std::invalid_argument& error) {
        EXPECT_NE(
            std::string(error.what()).find(row ? "point 3 of the rows" : "point 3 of the col"),
            std::string::npos)
            << error.what();
      }
    }
  }
}

// Thousands of points, proven optimal by the labels.
TEST(AssignPoints, ProvesItselfOptimalOnThousandsOfPoints) {
  std::mt19937_64 random(6);
  const auto draw = [&] { return uniform(random); };
  const auto rows = draw_points<Point2>(3000, draw), columns = draw_points<Point2>(3000, draw);
  EXPECT_LE(check_points(assign_points(rows, columns), rows, columns), 1e-12);
}

}  // namespace
}  // namespace terrace::matching
