// SPDX-License-Identifier: GPL-3.0-or-later
// Uses CGAL's Delaunay_triangulation_2 on points mapped without rounding as an oracle, and compares
// signs of the predicates with rational numbers.
#include <cmath>
#include <random>

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <gtest/gtest.h>

#include "delaunay2/access.hpp"
#include "metrics.hpp"
#include "points.hpp"

namespace terrace::tri::test {
namespace {

using Exact = CGAL::Exact_predicates_exact_constructions_kernel;
using MappedVertex2 = CGAL::Triangulation_vertex_base_with_info_2<std::size_t, Exact>;
using MappedOracle2 =
    CGAL::Delaunay_triangulation_2<Exact, CGAL::Triangulation_data_structure_2<MappedVertex2>>;

std::vector<Corners> mapped_triangles(const std::vector<PlanePoint>& points, const LinearMap2& m) {
  std::vector<std::pair<Exact::Point_2, std::size_t>> mapped;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Exact::FT x(points[i][0]), y(points[i][1]);
    mapped.emplace_back(Exact::Point_2(Exact::FT(m[0]) * x + Exact::FT(m[1]) * y,
                                       Exact::FT(m[2]) * x + Exact::FT(m[3]) * y),
                        i);
  }
  const MappedOracle2 oracle(mapped.begin(), mapped.end());
  std::vector<Corners> result;
  for (const auto& face : oracle.finite_face_handles()) {
    Corners t;
    for (int i = 0; i < 3; ++i) t[static_cast<std::size_t>(i)] = points[face->vertex(i)->info()];
    result.push_back(rotated(t));
  }
  std::sort(result.begin(), result.end());
  return result;
}

TEST(EllipticalMetric2, MatchesCgalOnMappedPointsIncludingTies) {
  for (const PointSet kind : kPointSets) {
    for (std::size_t m = 0; m < lower_maps().size(); ++m) {
      SCOPED_TRACE(name(kind) + " map " + std::to_string(m));
      const auto points = make_points<double>(kind, 220, 31 + m);
      Elliptical2 triangulation(lower_maps()[m]);
      triangulation.build(points);
      ASSERT_EQ(find_fault(triangulation), "");
      ASSERT_TRUE(triangles_of(triangulation) == mapped_triangles(points, lower_maps()[m]));
    }
  }
}

TEST(EllipticalMetric2, MatchesCgalOnMappedPointsForEllipses) {
  for (const double angle : {0.0, 17.0, 45.0, 90.0, 123.456, -60.0}) {
    for (const double ratio : {1.0, 3.0, 40.0}) {
      SCOPED_TRACE("angle " + std::to_string(angle) + " ratio " + std::to_string(ratio));
      const LinearMap2 map = ellipse_map(ratio, 1, angle);
      EXPECT_EQ(map[1], map[2]);
      const auto points = make_points<double>(PointSet::uniform, 3000, 5);
      Elliptical2 triangulation(map);
      triangulation.build(points);
      ASSERT_TRUE(triangles_of(triangulation) == mapped_triangles(points, map));
    }
  }
}

TEST(EllipticalKernel, SignsAreExact) {
  using planar::EllipticalKernel;
  std::mt19937_64 random(6);
  for (int round = 0; round < 4000; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    // From easy to undecidable in doubles, as for DoubleKernel.
    const double scale = std::ldexp(1.0, static_cast<int>(random() % 500) - 250);
    const double offset = round % 3 == 0 ? 0 : std::ldexp(scale, static_cast<int>(random() % 50));
    std::array<PlanePoint, 4> p;
    for (auto& point : p) {
      for (double& c : point) {
        c = offset + scale * static_cast<double>(random() % 16);
        if (random() % 4 == 0) c = std::nextafter(c, random() % 2 == 0 ? -1e300 : 1e300);
      }
    }
    LinearMap2 map;
    do {
      for (double& entry : map) {
        entry = std::ldexp(static_cast<double>(random() % 9) - 4.0,
                           round % 5 == 0 ? static_cast<int>(random() % 200) - 100 : 0);
      }
    } while (map[0] * map[3] == map[1] * map[2]);
    const planar::QuadraticForm form(map);
    const EllipticalKernel::Scope scope(form);
    ASSERT_EQ(EllipticalKernel::in_circle(p[0], p[1], p[2], p[3]),
              in_ellipse(map, p[0], p[1], p[2], p[3]));
    using Q = CGAL::Exact_rational;
    const auto squared = [&](const PlanePoint& a) -> Q {
      return square(map, Q(a[0]) - Q(p[0][0]), Q(a[1]) - Q(p[0][1]));
    };
    ASSERT_EQ(EllipticalKernel::compare_distance(p[0], p[1], p[2]),
              static_cast<int>(CGAL::sign(Q(squared(p[1]) - squared(p[2])))));
  }
}

}  // namespace
}  // namespace terrace::tri::test
