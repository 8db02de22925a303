// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/interpolation.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "delaunay2/access.hpp"
#include "delaunay2/double_kernel.hpp"
#include "interpolation_queries.hpp"

namespace terrace::tri {
namespace {

using planar::DoubleKernel;
constexpr Interpolation kInterpolations[] = {Interpolation::nearest, Interpolation::linear,
                                             Interpolation::natural_neighbour};
const double kNan = std::numeric_limits<double>::quiet_NaN();

template <class Coord>
class InterpolationTest : public ::testing::Test {
 public:
  /// Decides at every edge of the hull, or of the line.
  static bool in_hull(const Delaunay2<Coord>& triangulation, const Point2& query) {
    for (const TriangleId t : triangulation.all_triangles()) {
      const auto v = triangulation.vertices(t);
      bool inside = true;
      for (std::size_t i = 0; i < 3; ++i)
        inside = inside &&
                 DoubleKernel::orientation(query_at(triangulation, v[i]),
                                           query_at(triangulation, v[(i + 1) % 3]), query) >= 0;
      if (inside) return true;
    }
    if (triangulation.triangle_count() > 0) return false;
    std::vector<Point2> line;
    for (const VertexId v : triangulation.all_vertices())
      line.push_back(query_at(triangulation, v));
    std::sort(line.begin(), line.end());
    if (line.empty() || query < line.front() || line.back() < query) return false;
    return line.size() == 1 || DoubleKernel::orientation(line.front(), line.back(), query) == 0;
  }
};
using Coords = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(InterpolationTest, Coords);

TYPED_TEST(InterpolationTest, WeightsObeyTheirLaws) {
  std::vector<VertexWeight> weights;
  for (const PointSet kind : kPointSets) {
    for (const std::size_t count : {1u, 2u, 3u, 9u, 300u}) {
      SCOPED_TRACE(name(kind) + " " + std::to_string(count));
      Delaunay2<TypeParam> triangulation;
      triangulation.build(make_points<TypeParam>(kind, count, count));
      for (const Point2& query : make_queries(triangulation, 140, count)) {
        SCOPED_TRACE(std::to_string(query[0]) + ", " + std::to_string(query[1]));
        for (const Interpolation method :
             {Interpolation::linear, Interpolation::natural_neighbour}) {
          weights_at(triangulation, query, method, weights);
          ASSERT_EQ(!weights.empty(), this->in_hull(triangulation, query));
          if (weights.empty()) continue;
          // The sum, and the mean of the vertices. Uses halves, as differences may overflow.
          double sum = 0;
          Point2 mean{};
          Point2 extent{};
          for (const auto& [vertex, weight] : weights) {
            ASSERT_GE(weight, 0);
            sum += weight;
            for (std::size_t k = 0; k < 2; ++k) {
              const double from_query = query_at(triangulation, vertex)[k] / 2 - query[k] / 2;
              mean[k] += weight * from_query;
              extent[k] = std::max(extent[k], std::abs(from_query));
            }
          }
          ASSERT_NEAR(sum, 1, 1e-14);
          for (std::size_t k = 0; k < 2; ++k)
            ASSERT_LE(std::abs(mean[k]), 1e-11 * extent[k] + 0x1p-1073);
          ASSERT_TRUE(method == Interpolation::natural_neighbour || weights.size() <= 3);
          const Location at = [&]() -> Location {
            if constexpr (std::is_same_v<TypeParam, double>) return triangulation.locate(query);
            return {};
          }();
          if (at.place == Place::vertex) {
            ASSERT_EQ(weights.size(), 1u);
            ASSERT_EQ(weights[0].vertex, at.vertex);
          }
        }
      }
    }
  }
}

TYPED_TEST(InterpolationTest, LinearWeightsAreThoseOfOneTriangle) {
  Delaunay2<TypeParam> triangulation;
  triangulation.build(make_points<TypeParam>(PointSet::seven_bits, 200, 1));
  std::vector<VertexWeight> weights;
  for (const Point2& query : make_queries(triangulation, 300, 1)) {
    weights_at(triangulation, query, Interpolation::linear, weights);
    if (weights.empty()) continue;
    // The sum and the mean, which are tested above, determine the weights in a triangle.
    std::size_t holders = 0;
    for (const TriangleId t : triangulation.all_triangles()) {
      const auto corners = triangulation.vertices(t);
      holders += std::all_of(weights.begin(), weights.end(), [&](const VertexWeight& w) {
        return std::find(corners.begin(), corners.end(), w.vertex) != corners.end();
      });
    }
    ASSERT_GE(holders, 1u);
  }
}

TYPED_TEST(InterpolationTest, NearestIsNearest) {
  std::vector<VertexWeight> weights;
  for (const PointSet kind : kPointSets) {
    for (const std::size_t count : {1u, 2u, 40u, 150u}) {
      SCOPED_TRACE(name(kind) + " " + std::to_string(count));
      Delaunay2<TypeParam> triangulation;
      triangulation.build(make_points<TypeParam>(kind, count, 2));
      for (const Point2& query : make_queries(triangulation, 60, 3)) {
        VertexId best = kNoVertex;
        for (const VertexId v : triangulation.all_vertices()) {
          if (best == kNoVertex) best = v;
          const int order = DoubleKernel::compare_distance(query, query_at(triangulation, v),
                                                           query_at(triangulation, best));
          if (order < 0 || (order == 0 && triangulation.point(v) < triangulation.point(best)))
            best = v;
        }
        weights_at(triangulation, query, Interpolation::nearest, weights);
        ASSERT_EQ(weights.size(), 1u);
        ASSERT_EQ(weights[0].vertex, best);
        ASSERT_EQ(weights[0].weight, 1);
      }
    }
  }
}

TYPED_TEST(InterpolationTest, WeightsDoNotDependOnCocircularDiagonals) {
  // In a mirrored set the perturbation chooses the other diagonals. The weights must not change.
  Delaunay2<TypeParam> grid;
  grid.build_grid(0, 0, 7, 12, 12);
  Delaunay2<TypeParam> mirrored;
  std::vector<std::array<TypeParam, 2>> points;
  for (const VertexId v : grid.all_vertices())
    points.push_back({static_cast<TypeParam>(77 - grid.point(v)[0]), grid.point(v)[1]});
  points.erase(points.begin() + 30);
  mirrored.build(points);
  const VertexId gap = grid.nearest({6 * 7, 2 * 7});
  grid.remove(gap);
  ASSERT_EQ(grid.vertex_count(), mirrored.vertex_count());
  std::vector<VertexWeight> left;
  std::vector<VertexWeight> right;
  std::size_t compared = 0;
  for (const Point2& query : make_queries(grid, 700, 5)) {
    const Point2 other{77 - query[0], query[1]};
    if (77 - other[0] != query[0]) continue;  // rounded
    weights_at(grid, query, Interpolation::natural_neighbour, left);
    weights_at(mirrored, other, Interpolation::natural_neighbour, right);
    std::map<Point2, double> difference;
    for (const auto& [vertex, weight] : left) {
      const Point2 p = query_at(grid, vertex);
      difference[{77 - p[0], p[1]}] += weight;
    }
    for (const auto& [vertex, weight] : right) difference[query_at(mirrored, vertex)] -= weight;
    for (const auto& [point, value] : difference) ASSERT_NEAR(value, 0, 1e-11);
    ++compared;
  }
  EXPECT_GT(compared, 200u);
}

TYPED_TEST(InterpolationTest, NaturalNeighboursAreContinuousAcrossCircles) {
  for (const PointSet kind : {PointSet::grid, PointSet::seven_bits}) {
    SCOPED_TRACE(name(kind));
    Delaunay2<TypeParam> triangulation;
    triangulation.build(make_points<TypeParam>(kind, 400, 1));
    std::mt19937_64 random(2);
    std::vector<double> heights(triangulation.vertex_slots());
    for (double& h : heights) h = to_unit(random());
    // Takes steps along lines through the whole set. Vertices are at least 1 apart and heights
    // differ by less than 1, so no slope in these sets is near 100.
    const double step = 1e-5;
    std::vector<Point2> queries;
    for (int line = 0; line < 20; ++line) {
      const Point2 start{to_unit(random()) * 100 + 10, to_unit(random()) * 100 + 10};
      const double angle = to_unit(random()) * 6.28;
      for (int i = 0; i < 2; ++i) {
        for (int k = 0; k < 500; ++k) {
          const double at = 0.05 * k + i * step;
          queries.push_back({start[0] + at * std::cos(angle), start[1] + at * std::sin(angle)});
        }
      }
    }
    // Crosses the circles themselves. Lattice points are on many of them.
    for (int x = 10; x < 90; ++x) {
      queries.push_back({x - step / 2, 0.5 * x + 13});
      queries.push_back({x + step / 2, 0.5 * x + 13});
    }
    const auto values =
        heights_at(triangulation, heights, queries, Interpolation::natural_neighbour);
    std::size_t compared = 0;
    const auto compare = [&](std::size_t i, std::size_t k) {
      if (std::isnan(values[i]) || std::isnan(values[k])) return;
      ASSERT_LE(std::abs(values[i] - values[k]), 100 * step);
      ++compared;
    };
    for (std::size_t i = 0; i < 20'000; i += 1000)
      for (std::size_t k = 0; k < 500; ++k) compare(i + k, i + k + 500);
    for (std::size_t i = 20'000; i < queries.size(); i += 2) compare(i, i + 1);
    EXPECT_GT(compared, 5000u);
  }
}

TYPED_TEST(InterpolationTest, ManyQueriesEqualSingleOnesForAnyNumberOfThreads) {
  Delaunay2<TypeParam> triangulation;
  const auto points = make_points<TypeParam>(PointSet::uniform, 3000, 4);
  triangulation.build(points);
  std::mt19937_64 random(4);
  std::vector<double> heights(triangulation.vertex_slots());
  for (double& h : heights) h = to_unit(random());
  std::vector<Point2> queries = make_queries(triangulation, 20'000, 6);
  for (std::size_t i = 0; i < 500; ++i) queries.push_back(queries[random() % 1000]);
  std::vector<VertexWeight> weights;
  for (const Interpolation method : kInterpolations) {
    const auto one = heights_at(triangulation, heights, queries, method, 1);
    const auto four = heights_at(triangulation, heights, queries, method, 4);
    ASSERT_EQ(one.size(), queries.size());
    ASSERT_EQ(std::memcmp(one.data(), four.data(), one.size() * sizeof(double)), 0);
    for (std::size_t i = 0; i < queries.size(); i += 11) {
      weights_at(triangulation, queries[i], method, weights);
      double sum = weights.empty() ? kNan : 0;
      for (const auto& [vertex, weight] : weights) sum += weight * heights[slot(vertex)];
      if (std::isnan(sum)) {
        ASSERT_TRUE(std::isnan(one[i]));
      } else {
        ASSERT_NEAR(one[i], sum, 1e-11);
      }
    }
  }
  for (const GradientFrom from : {GradientFrom::triangles, GradientFrom::natural_neighbours}) {
    const auto one = gradients_at(triangulation, heights, queries, from, 1);
    const auto four = gradients_at(triangulation, heights, queries, from, 4);
    ASSERT_EQ(std::memcmp(one.data(), four.data(), one.size() * sizeof(Gradient)), 0);
  }
}

/// For gradients: points without needles in a square of side 1000.
template <class Coord>
std::vector<std::array<Coord, 2>> spread_points(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<std::array<Coord, 2>> points;
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 20; ++x)
      points.push_back({static_cast<Coord>(50 * x + static_cast<int>(random() % 30)),
                        static_cast<Coord>(50 * y + static_cast<int>(random() % 30))});
  return points;
}

TYPED_TEST(InterpolationTest, GradientsOfPlanesAreExactEverywhere) {
  for (const bool regular : {false, true}) {
    Delaunay2<TypeParam> triangulation;
    triangulation.build(regular ? make_points<TypeParam>(PointSet::grid, 400, 1)
                                : spread_points<TypeParam>(1));
    const auto plane = [&](VertexId v) {
      const Point2 p = query_at(triangulation, v);
      return 3 + 0.25 * p[0] - 2 * p[1];
    };
    const auto queries = make_queries(triangulation, 1000, 2);
    for (const GradientFrom from : {GradientFrom::triangles, GradientFrom::natural_neighbours}) {
      const auto gradients = gradients_at(triangulation, plane, queries, from);
      std::size_t inside = 0;
      for (std::size_t i = 0; i < queries.size(); ++i) {
        SCOPED_TRACE(std::to_string(queries[i][0]) + ", " + std::to_string(queries[i][1]));
        ASSERT_EQ(std::isnan(gradients[i].x), !this->in_hull(triangulation, queries[i]));
        if (std::isnan(gradients[i].x)) continue;
        ASSERT_NEAR(gradients[i].x, 0.25, 1e-10);
        ASSERT_NEAR(gradients[i].y, -2, 1e-10);
        ++inside;
      }
      EXPECT_GT(inside, 500u);
    }
  }
}

TYPED_TEST(InterpolationTest, GradientsAreDerivatives) {
  Delaunay2<TypeParam> triangulation;
  triangulation.build(spread_points<TypeParam>(3));
  std::mt19937_64 random(3);
  std::vector<double> heights(triangulation.vertex_slots());
  for (double& h : heights) h = 100 * to_unit(random());
  std::vector<Point2> queries;
  for (int i = 0; i < 400; ++i)
    queries.push_back({60 + 850 * to_unit(random()), 60 + 850 * to_unit(random())});
  const double step = 1e-4;
  std::vector<Point2> neighbours;
  for (const Point2& p : queries)
    for (const Point2& d : {Point2{step, 0}, {-step, 0}, {0, step}, {0, -step}})
      neighbours.push_back({p[0] + d[0], p[1] + d[1]});
  for (const bool natural : {false, true}) {
    const auto gradients =
        gradients_at(triangulation, heights, queries,
                     natural ? GradientFrom::natural_neighbours : GradientFrom::triangles);
    const auto values =
        heights_at(triangulation, heights, neighbours,
                   natural ? Interpolation::natural_neighbour : Interpolation::linear);
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const double x = (values[4 * i] - values[4 * i + 1]) / (2 * step);
      const double y = (values[4 * i + 2] - values[4 * i + 3]) / (2 * step);
      ASSERT_NEAR(gradients[i].x, x, 1e-3);
      ASSERT_NEAR(gradients[i].y, y, 1e-3);
    }
  }
}

TEST(Interpolation, GradientsOnEdgesAndVerticesAreMeans) {
  // A square of four triangles about its centre, which is raised.
  Delaunay2<double> triangulation;
  const std::vector<std::array<double, 2>> points{{0, 0}, {4, 0}, {4, 4}, {0, 4}, {2, 1}};
  const auto vertices = triangulation.build(points);
  const auto height = [&](VertexId v) { return v == vertices[4] ? 1.0 : 0.0; };
  const auto at = [&](Point2 p, GradientFrom from) {
    return gradients_at(triangulation, height, std::span(&p, 1), from, 1)[0];
  };
  const GradientFrom triangles = GradientFrom::triangles;
  const GradientFrom natural = GradientFrom::natural_neighbours;
  EXPECT_DOUBLE_EQ(at({2, 0.5}, triangles).y, 1);
  EXPECT_DOUBLE_EQ(at({2, 3}, triangles).y, -1.0 / 3);
  // The edge from (0, 0) to the top: gradients (0, 1) and (1 / 2, 0), areas 2 and 4.
  EXPECT_DOUBLE_EQ(at({1, 0.5}, triangles).x, 1.0 / 3);
  EXPECT_DOUBLE_EQ(at({1, 0.5}, triangles).y, 1.0 / 3);
  // At the top the sum over a closed fan with a level border is zero. The corner has its two
  // triangles.
  EXPECT_DOUBLE_EQ(at({2, 1}, triangles).x, 0);
  EXPECT_DOUBLE_EQ(at({2, 1}, triangles).y, 0);
  for (const GradientFrom from : {triangles, natural}) {
    EXPECT_DOUBLE_EQ(at({0, 0}, from).x, 1.0 / 3);
    EXPECT_DOUBLE_EQ(at({0, 0}, from).y, 1.0 / 3);
    EXPECT_DOUBLE_EQ(at({1, 0}, from).y, 1);
    EXPECT_TRUE(std::isnan(at({-1, 0}, from).x));
  }
}

TEST(Interpolation, HandlesManyNeighboursOfOneQuery) {
  // In a regular polygon every circle through three of its corners contains the centre.
  constexpr std::size_t kCorners = 1500;
  std::vector<std::array<double, 2>> points;
  for (std::size_t i = 0; i < kCorners; ++i) {
    const double angle = 2 * 3.14159265358979323846 * static_cast<double>(i) / kCorners;
    points.push_back({std::cos(angle), std::sin(angle)});
  }
  Delaunay2<double> triangulation;
  triangulation.build(points);
  std::vector<VertexWeight> weights;
  weights_at(triangulation, {0, 0}, Interpolation::natural_neighbour, weights);
  ASSERT_EQ(weights.size(), kCorners);
  for (const auto& [vertex, weight] : weights) ASSERT_NEAR(weight, 1.0 / kCorners, 1e-11);
}

TEST(Interpolation, ManyNearlyCocircularNeighboursReproducePlanes) {
  // Doubles do not suffice, and sums of exact quotients would have as many digits as neighbours.
  std::vector<std::array<double, 2>> points;
  for (int i = 0; i < 400; ++i) {
    points.push_back({1000 * std::cos(i * 0.1), 1000 * std::sin(i * 0.1)});
  }
  Delaunay2<double> triangulation;
  const std::vector<VertexId> vertices = triangulation.build(points);
  std::vector<double> heights(triangulation.vertex_slots());
  for (std::size_t i = 0; i < points.size(); ++i) {
    heights[slot(vertices[i])] = 3 + 0.25 * points[i][0] - 0.5 * points[i][1];
  }
  const std::vector<std::array<double, 2>> queries{{1, 2}, {300, -400}};
  const std::vector<double> at =
      heights_at(triangulation, heights, queries, Interpolation::natural_neighbour, 1);
  const std::vector<Gradient> gradients =
      gradients_at(triangulation, heights, queries, GradientFrom::natural_neighbours, 1);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    EXPECT_NEAR(at[i], 3 + 0.25 * queries[i][0] - 0.5 * queries[i][1], 1e-8);
    EXPECT_NEAR(gradients[i].x, 0.25, 1e-9);
    EXPECT_NEAR(gradients[i].y, -0.5, 1e-9);
  }
}

TEST(Interpolation, SlopeAndAspect) {
  EXPECT_DOUBLE_EQ(slope_degrees({1, 0}), 45);
  EXPECT_DOUBLE_EQ(slope_degrees({0, 0}), 0);
  EXPECT_DOUBLE_EQ(slope_degrees({3, 4}), std::atan(5) * 180 / 3.14159265358979323846);
  EXPECT_TRUE(std::isnan(slope_degrees({})));
  // A surface that rises to the north faces south, and so on, clockwise.
  EXPECT_DOUBLE_EQ(aspect_degrees({0, 1}), 180);
  EXPECT_DOUBLE_EQ(aspect_degrees({1, 0}), 270);
  EXPECT_DOUBLE_EQ(aspect_degrees({0, -1}), 0);
  EXPECT_DOUBLE_EQ(aspect_degrees({-1, 0}), 90);
  EXPECT_DOUBLE_EQ(aspect_degrees({-1, -1}), 45);
  EXPECT_DOUBLE_EQ(aspect_degrees({1, -1}), 315);
  EXPECT_LT(aspect_degrees({1e-300, -1}), 360);
  EXPECT_TRUE(std::isnan(aspect_degrees({0, -0.0})));
  EXPECT_TRUE(std::isnan(aspect_degrees({})));
}

/// The C library's atan and atan2 give different last bits for some of these.
TEST(Interpolation, SlopeAndAspectHaveTheSameBitsOnEveryMachine) {
  EXPECT_EQ(slope_degrees({0.1, 0.2}), 0x1.93571a47a1deep+3);
  EXPECT_EQ(aspect_degrees({0.1, 0.2}), 0x1.9d214e634c3b8p+7);
  EXPECT_EQ(aspect_degrees({-3.0, 0.7}), 0x1.9c893d24bba07p+6);
  EXPECT_EQ(slope_degrees({-1.7, -1.1}), 0x1.fdbc1ea252cd6p+5);
  for (double g = 1e-12; g < 1e12; g *= 1.07) {
    const double x = g * 0.8, y = -g * g;
    const double slope = std::atan(std::hypot(x, y)) * (180 / std::numbers::pi);
    ASSERT_NEAR(slope_degrees({x, y}), slope, 1e-15 * slope) << g;
    ASSERT_NEAR(aspect_degrees({-x, y}), std::atan2(x, -y) * (180 / std::numbers::pi), 1e-13) << g;
  }
}

TEST(Interpolation, HeightsComeFromArraysFunctionsAndModels) {
  Delaunay2<std::int32_t> triangulation;
  triangulation.build_grid(0, 0, 1, 3, 3);
  struct Model {
    double height(VertexId v) const { return slot(v); }
  };
  std::vector<double> array(triangulation.vertex_slots());
  for (std::size_t i = 0; i < array.size(); ++i) array[i] = static_cast<double>(i);
  const Model model;
  const std::vector<Point2> queries{{0.25, 0.5}, {2, 2}, {-1, 0}};
  for (const Interpolation method : kInterpolations) {
    const auto expected = heights_at(triangulation, array, queries, method);
    EXPECT_EQ(std::isnan(expected[2]), method != Interpolation::nearest);
    const auto other = heights_at(triangulation, model, queries, method);
    const auto third = heights_at(
        triangulation, [](VertexId v) { return double{0} + slot(v); }, queries, method);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(other[i], expected[i]);
      EXPECT_EQ(third[i], expected[i]);
    }
  }
}

TEST(Interpolation, RefusesBadData) {
  Delaunay2<std::int32_t> triangulation;
  triangulation.build_grid(0, 0, 1, 3, 3);
  std::vector<double> heights(triangulation.vertex_slots(), 1.0);
  const auto message = [&](const std::vector<Point2>& queries) -> std::string {
    try {
      heights_at(triangulation, heights, queries, Interpolation::linear);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message({{0, 0}, {1, kNan}}).find("query 1"), std::string::npos);
  EXPECT_NE(message({{-INFINITY, 0}}).find("query 0"), std::string::npos);
  EXPECT_EQ(message({}), "");
  EXPECT_EQ(message({{1e308, -1e308}, {-5e-324, 5e-324}}), "");
  heights.pop_back();
  EXPECT_NE(message({{0, 0}}).find("vertex_slots"), std::string::npos);
  std::vector<VertexWeight> weights{{VertexId{1}, 1}};
  EXPECT_THROW(weights_at(triangulation, {kNan, 0}, Interpolation::nearest, weights),
               std::invalid_argument);
  const Delaunay2<double> empty;
  for (const Interpolation method : kInterpolations) {
    weights_at(empty, {1, 2}, method, weights);
    EXPECT_TRUE(weights.empty());
    const std::vector<Point2> queries{{1, 2}};
    const std::vector<double> one(empty.vertex_slots());
    EXPECT_TRUE(std::isnan(heights_at(empty, one, queries, method)[0]));
  }
}

TEST(Interpolation, ExceptionsOfHeightFunctionsPropagate) {
  Delaunay2<std::int32_t> triangulation;
  triangulation.build_grid(0, 0, 1, 3, 3);
  const auto fails = [](VertexId) -> double { throw std::runtime_error("no height"); };
  const std::vector<Point2> queries(50'000, {0.5, 0.25});
  EXPECT_THROW(heights_at(triangulation, fails, queries, Interpolation::linear, 3),
               std::runtime_error);
}

}  // namespace
}  // namespace terrace::tri
