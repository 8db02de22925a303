// SPDX-License-Identifier: GPL-3.0-or-later
// Uses CGAL's Delaunay_triangulation_3 on points mapped without rounding as an oracle, and compares
// signs of the predicates with rational numbers.
#include <cmath>
#include <random>

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>
#include <gtest/gtest.h>

#include "delaunay3/access.hpp"
#include "metrics3.hpp"
#include "points3.hpp"

namespace terrace::tri::test {
namespace {

using Exact = CGAL::Exact_predicates_exact_constructions_kernel;
using MappedVertex3 = CGAL::Triangulation_vertex_base_with_info_3<std::size_t, Exact>;
using MappedOracle3 =
    CGAL::Delaunay_triangulation_3<Exact, CGAL::Triangulation_data_structure_3<MappedVertex3>>;

std::vector<Corners3> mapped_tetrahedra(const std::vector<Space>& points, const LinearMap3& m) {
  std::vector<std::pair<Exact::Point_3, std::size_t>> mapped;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Exact::FT x(points[i][0]), y(points[i][1]), z(points[i][2]);
    const auto row = [&](std::size_t r) -> Exact::FT {
      return Exact::FT(m[r]) * x + Exact::FT(m[r + 1]) * y + Exact::FT(m[r + 2]) * z;
    };
    mapped.emplace_back(Exact::Point_3(row(0), row(3), row(6)), i);
  }
  const MappedOracle3 oracle(mapped.begin(), mapped.end());
  std::vector<Corners3> result;
  if (oracle.dimension() < 3) return result;
  for (const auto& cell : oracle.finite_cell_handles()) {
    Corners3 t;
    for (int i = 0; i < 4; ++i) t[static_cast<std::size_t>(i)] = points[cell->vertex(i)->info()];
    std::sort(t.begin(), t.end());
    result.push_back(t);
  }
  std::sort(result.begin(), result.end());
  return result;
}

TEST(EllipticalMetric3, MatchesCgalOnMappedPointsIncludingTies) {
  for (const PointSet3 kind : kPointSets3) {
    for (std::size_t m = 0; m < lower_maps3().size(); ++m) {
      SCOPED_TRACE(name(kind) + " map " + std::to_string(m));
      const auto points = make_points3<double>(kind, 60, 31 + m);
      Elliptical3 triangulation(lower_maps3()[m]);
      triangulation.build(points);
      ASSERT_EQ(find_fault(triangulation), "");
      ASSERT_TRUE(tetrahedra_of(triangulation) == mapped_tetrahedra(points, lower_maps3()[m]));
    }
  }
}

TEST(EllipticalMetric3, MatchesCgalOnMappedPointsForEllipsoids) {
  for (const LinearMap3& axes : rotations()) {
    for (const double ratio : {3.0, 40.0}) {
      SCOPED_TRACE("axes " + std::to_string(axes[0]) + " ratio " + std::to_string(ratio));
      const LinearMap3 map = ellipsoid_map({ratio, 1, std::sqrt(ratio)}, axes);
      EXPECT_EQ(map[1], map[3]);
      EXPECT_EQ(map[2], map[6]);
      EXPECT_EQ(map[5], map[7]);
      const auto points = make_points3<double>(PointSet3::uniform, 600, 5);
      Elliptical3 triangulation(map);
      triangulation.build(points);
      ASSERT_TRUE(tetrahedra_of(triangulation) == mapped_tetrahedra(points, map));
    }
  }
}

/// From easy to undecidable in doubles.
std::vector<Space> hard_points(int round, std::size_t count, std::mt19937_64& random) {
  const double scale = std::ldexp(1.0, static_cast<int>(random() % 200) - 100);
  const double offset = round % 3 == 0 ? 0 : std::ldexp(scale, static_cast<int>(random() % 50));
  std::vector<Space> points(count);
  for (Space& point : points) {
    for (double& c : point) {
      c = offset + scale * static_cast<double>(random() % (round % 4 == 0 ? 3 : 16));
      if (round % 2 != 0 && random() % 4 == 0)
        c = std::nextafter(c, random() % 2 == 0 ? -1e300 : 1e300);
    }
  }
  return points;
}

/// An invertible matrix of small integers, scaled in every fifth round by very different powers of
/// two.
LinearMap3 hard_map(int round, std::mt19937_64& random) {
  while (true) {
    LinearMap3 map;
    for (double& entry : map) {
      entry = std::ldexp(static_cast<double>(random() % 9) - 4.0,
                         round % 5 == 0 ? static_cast<int>(random() % 80) - 40 : 0);
    }
    if (round % 4 == 0) map[1] = map[2] = map[3] = map[5] = map[6] = map[7] = 0;
    try {
      check_metric(map, "");
      return map;
    } catch (const std::invalid_argument&) {
    }
  }
}

TEST(EllipticalKernel3, SignsAreExact) {
  using spatial::EllipticalKernel;
  std::mt19937_64 random(6);
  int decided = 0, tied = 0;
  for (int round = 0; round < 6000; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    const auto p = hard_points(round, 5, random);
    const LinearMap3 map = hard_map(round, random);
    const spatial::QuadraticForm form(map);
    const EllipticalKernel::Scope scope(form);
    Corners3 c{p[0], p[1], p[2], p[3]};
    const int turn = EllipticalKernel::orientation(c[0], c[1], c[2], c[3]);
    if (turn < 0) std::swap(c[0], c[1]);
    if (turn != 0) {
      const int side = in_ellipsoid(map, c, p[4]);
      ASSERT_EQ(EllipticalKernel::in_sphere(c[0], c[1], c[2], c[3], p[4]), side);
      tied += side == 0;
      using Corner = EllipticalKernel::Vertex;
      // The filter may leave anything undecided.
      const auto verdict = EllipticalKernel::Probe(p[4], {}).side(Corner{c[0], 0}, Corner{c[1], 0},
                                                                  Corner{c[2], 0}, Corner{c[3], 0});
      if (verdict != spatial::Verdict::open) {
        ASSERT_EQ(side, verdict == spatial::Verdict::in ? 1 : -1);
      }
      decided += verdict != spatial::Verdict::open;
    }
    ASSERT_EQ(EllipticalKernel::compare_distance(p[0], p[1], p[2]),
              static_cast<int>(CGAL::sign(Rational(square(map, exact_difference(p[1], p[0])) -
                                                   square(map, exact_difference(p[2], p[0]))))));
  }
  EXPECT_GT(decided, 1500);
  EXPECT_GT(tied, 20);
}

TEST(EllipticalKernel3, MappedDifferencesAreWithinTheirBound) {
  using spatial::EllipticalKernel;
  std::mt19937_64 random(7);
  for (int round = 0; round < 1000; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    const auto p = hard_points(round, 2, random);
    const LinearMap3 map = hard_map(round, random);
    const spatial::QuadraticForm form(map);
    if (!(form.spread() < 0x1p28)) continue;
    const EllipticalKernel::Scope scope(form);
    // Only lengths can be compared, because R equals M only up to a rotation and a power of two.
    const Space got = EllipticalKernel::mapped(p[1], p[0]);
    const double length = std::hypot(got[0], got[1], got[2]);
    double wanted = std::sqrt(CGAL::to_double(square(map, exact_difference(p[1], p[0]))));
    double most = 0;
    for (const double m : map) most = std::max(most, std::abs(m));
    int exponent = 0;
    std::frexp(most, &exponent);
    wanted = std::ldexp(wanted, -exponent);
    ASSERT_NEAR(length, wanted, (9 * form.spread() + 8) * 0x1p-53 * wanted);
  }
}

TEST(EllipticalKernel3, SmallestSpheresAreExact) {
  using spatial::EllipticalKernel;
  std::mt19937_64 random(8);
  int inside = 0, acute = 0;
  for (int round = 0; round < 4000; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    const auto p = hard_points(round, 4, random);
    if (EllipticalKernel::collinear(p[0], p[1], p[2])) continue;
    const LinearMap3 map = hard_map(round, random);
    const spatial::QuadraticForm form(map);
    const EllipticalKernel::Scope scope(form);
    // The smallest sphere, by its centre: the one through both ends of an edge that contains the
    // third corner, or the one through all three.
    std::array<Rationals, 4> at;
    for (std::size_t i = 0; i < 4; ++i) at[i] = mapped_by(map, exact_difference(p[i], p[0]));
    const auto minus = [](const Rationals& u, const Rationals& v) {
      return Rationals{u[0] - v[0], u[1] - v[1], u[2] - v[2]};
    };
    const auto distance2 = [&](const Rationals& u, const Rationals& v) -> Rational {
      const Rationals d = minus(u, v);
      return product(d, d);
    };
    Rationals centre{};
    Rational radius2 = -1;
    for (std::size_t i = 0; i < 3; ++i) {
      const Rationals& u = at[(i + 1) % 3];
      const Rationals& v = at[(i + 2) % 3];
      Rationals middle;
      for (std::size_t k = 0; k < 3; ++k) middle[k] = (u[k] + v[k]) / 2;
      if (distance2(middle, at[i]) > distance2(middle, u)) continue;
      centre = middle;
      radius2 = distance2(middle, u);
    }
    if (radius2 < 0) {
      ++acute;
      // Equidistant from all three, in their plane: a linear system solved by Cramer's rule.
      const Rationals &e = at[1], &f = at[2];
      const Rationals n{e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2],
                        e[0] * f[1] - e[1] * f[0]};
      const Rational volume = determinant(e, f, n);
      const Rationals right{product(e, e) / 2, product(f, f) / 2, 0};
      for (std::size_t k = 0; k < 3; ++k) {
        std::array<Rationals, 3> rows{e, f, n};
        for (std::size_t r = 0; r < 3; ++r) rows[r][k] = right[r];
        centre[k] = determinant(rows[0], rows[1], rows[2]) / volume;
      }
      radius2 = product(centre, centre);
    }
    const bool wanted = distance2(centre, at[3]) < radius2;
    ASSERT_EQ(EllipticalKernel::in_smallest_sphere(p[0], p[1], p[2], p[3]), wanted);
    inside += wanted;
  }
  EXPECT_GT(inside, 100);
  EXPECT_GT(acute, 100);
}

}  // namespace
}  // namespace terrace::tri::test
