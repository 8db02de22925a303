// SPDX-License-Identifier: GPL-3.0-or-later
// CGAL's natural_neighbor_coordinates_2 with exact constructions as an oracle.
#include <cmath>
#include <map>
#include <random>
#include <string>

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_rational.h>
#include <CGAL/natural_neighbor_coordinates_2.h>
#include <gtest/gtest.h>

#include "interpolation/bounded_number.hpp"
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
        // within this, the result is less exact
        CGAL::to_double(CGAL::exact(weight / result.second));
  return weights;
}

/// Compares the values, bounds and roundings of random sums, products and quotients with rationals.
TEST(BoundedNumber, IsWithinItsBoundOfTheExactResult) {
  using planar::BoundedNumber;
  using Rational = CGAL::Exact_rational;
  const auto rational = [](BoundedNumber::Wide value) {
    Rational sum = 0;
    for (int part = 0; part < 3; ++part) {  // 113 bits
      const auto leading = value.convert_to<double>();
      sum += Rational(leading);
      value -= leading;
    }
    return sum;
  };
  const auto distance = [](const Rational& a, const Rational& b) { return CGAL::abs(a - b); };
  std::mt19937_64 random(11);
  int certain = 0;
  constexpr int kRounds = 2000;
  for (int round = 0; round < kRounds; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    BoundedNumber number(0);
    Rational exact = 0;
    for (int step = 0; step < 12; ++step) {
      // Includes small integers, so that much cancels.
      const double other = random() % 2 == 0
                               ? static_cast<double>(random() % 9) - 4
                               : std::ldexp(to_unit(random()), static_cast<int>(random() % 60));
      switch (random() % 4) {
        case 0:
          number += other;
          exact += other;
          break;
        case 1:
          number -= other;
          exact -= other;
          break;
        case 2:
          number = number * BoundedNumber(other);
          exact *= other;
          break;
        default:
          if (other == 0) break;
          number = number / BoundedNumber(other);
          exact /= other;
      }
      if (random() % 4 == 0 && exact != 0) {
        number = BoundedNumber(1) / number;
        exact = 1 / exact;
      }
    }
    if (!std::isfinite(number.error())) continue;
    ASSERT_LE(distance(rational(number.value()), exact), Rational(number.error()));
    const double rounded = number.rounded();
    if (std::isnan(rounded)) continue;
    ++certain;
    for (const double side : {-1e300, 1e300}) {
      ASSERT_LE(distance(rounded, exact), distance(std::nextafter(rounded, side), exact));
    }
  }
  EXPECT_GT(certain, kRounds / 2);
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
        const Weights cgal_weights = weights_of(oracle, query);
        weights_at(triangulation, query, Interpolation::natural_neighbour, ours);
        ASSERT_EQ(ours.empty(), cgal_weights.empty());
        Weights difference = cgal_weights;
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
