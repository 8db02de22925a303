// SPDX-License-Identifier: GPL-3.0-or-later
// CGAL's natural_neighbor_coordinates_2 with exact constructions as an oracle.
#include <map>

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/natural_neighbor_coordinates_2.h>
#include <gtest/gtest.h>

#include "interpolation_queries.hpp"

namespace terrace::tri {
namespace {

using Exact = CGAL::Exact_predicates_exact_constructions_kernel;
using ExactOracle = CGAL::Delaunay_triangulation_2<Exact>;
using Weights = std::map<Point2, double>;

Point2 to_point(const Exact::Point_2& p) {
  return {CGAL::to_double(p.x()), CGAL::to_double(p.y())};
}

/// Empty outside the hull.
Weights weights_of(const ExactOracle& oracle, const Point2& query) {
  std::vector<std::pair<Exact::Point_2, Exact::FT>> found;
  const auto result = CGAL::natural_neighbor_coordinates_2(
      oracle, Exact::Point_2(query[0], query[1]), std::back_inserter(found));
  Weights weights;
  if (!result.third) return weights;
  for (const auto& [point, weight] : found)
    weights[to_point(point)] =
        // of the interval the result is less exact
        CGAL::to_double(CGAL::exact(weight / result.second));
  return weights;
}

template <class Coord>
class InterpolationCgalTest : public ::testing::Test {};
using Coords = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(InterpolationCgalTest, Coords);

TYPED_TEST(InterpolationCgalTest, SameNaturalNeighbourCoordinates) {
  for (const PointSet kind : kPointSets) {
    for (const std::size_t count : {6u, 40u, 300u}) {
      SCOPED_TRACE(name(kind) + " " + std::to_string(count));
      const auto points = make_points<TypeParam>(kind, count, 7 + count);
      Delaunay2<TypeParam> triangulation;
      triangulation.build(points);
      if (triangulation.triangle_count() == 0) continue;
      ExactOracle oracle;
      for (const auto& p : points)
        oracle.insert(Exact::Point_2(static_cast<double>(p[0]), static_cast<double>(p[1])));
      std::vector<VertexWeight> ours;
      for (const Point2& query : make_queries(triangulation, 70, count)) {
        SCOPED_TRACE(std::to_string(query[0]) + ", " + std::to_string(query[1]));
        const Weights theirs = weights_of(oracle, query);
        weights_at(triangulation, query, Interpolation::kNaturalNeighbour, ours);
        ASSERT_EQ(ours.empty(), theirs.empty());
        Weights difference = theirs;
        for (const auto& [vertex, weight] : ours)
          difference[query_at(triangulation, vertex)] -= weight;
        for (const auto& [point, value] : difference) {
          ASSERT_NEAR(value, 0, 1e-11);
        }
      }
    }
  }
}

}  // namespace
}  // namespace terrace::tri
