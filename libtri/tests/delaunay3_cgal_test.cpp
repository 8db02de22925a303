// SPDX-License-Identifier: Apache-2.0
// Compares sets of tetrahedra and signs of predicates with CGAL's, on synthetic points.
#include <algorithm>
#include <cmath>

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <gtest/gtest.h>

#include "delaunay3/access.hpp"
#include "delaunay3/predicates.hpp"
#include "delaunay3_oracle.hpp"
#include "points3.hpp"

namespace terrace::tri {
namespace {

template <class Coord>
class Delaunay3CgalTest : public ::testing::Test {};
using Coords = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(Delaunay3CgalTest, Coords);

TYPED_TEST(Delaunay3CgalTest, SameTetrahedra) {
  for (const PointSet3 kind : kPointSets3) {
    for (const std::size_t count : {4u, 10u, 150u, 2000u}) {
      // Two lines of points have a tetrahedron for each pair of edges.
      if (kind == PointSet3::curves && count > 150) continue;
      SCOPED_TRACE(name(kind) + " " + std::to_string(count));
      const auto points = make_points3<TypeParam>(kind, count, 31);
      Delaunay3<TypeParam> triangulation;
      triangulation.build(points);
      const auto cgal_points = to_cgal(points);
      expect_equal_to_cgal(triangulation, Oracle3(cgal_points.begin(), cgal_points.end()));
    }
  }
}

TYPED_TEST(Delaunay3CgalTest, SameTetrahedraAfterRemoval) {
  for (const PointSet3 kind : kPointSets3) {
    if (kind == PointSet3::curves) continue;
    SCOPED_TRACE(name(kind));
    const auto points = make_points3<TypeParam>(kind, 300, 32);
    std::mt19937_64 random(33);
    Delaunay3<TypeParam> triangulation;
    triangulation.build(points);
    for (int round = 0; round < 3; ++round) {
      std::vector<VertexId> going;
      for (const VertexId v : triangulation.all_vertices())
        if (random() % 3 == 0) going.push_back(v);
      triangulation.remove(std::span<const VertexId>(going));
      std::vector<std::array<TypeParam, 3>> left;
      for (const VertexId v : triangulation.all_vertices()) left.push_back(triangulation.point(v));
      const auto cgal_points = to_cgal(left);
      expect_equal_to_cgal(triangulation, Oracle3(cgal_points.begin(), cgal_points.end()));
    }
  }
}

TEST(Delaunay3Cgal, SameTetrahedraWhenPointsLeaveTheLattice) {
  // Multiples of a power of two, then points in between, then again without these.
  for (const double scale : {1.0, 0x1p-30, 0x1p-79, 0x1p-82, 0x1p79, 0x1p100, 0.1}) {
    SCOPED_TRACE("scale " + std::to_string(std::log2(scale)));
    std::mt19937_64 random(35);
    std::vector<Delaunay3<double>::Point> points;
    for (int i = 0; i < 300; ++i) {
      points.emplace_back();
      for (double& c : points.back()) c = scale * (static_cast<double>(random() % 8) - 3);
    }
    Delaunay3<double> triangulation;
    triangulation.build(points);
    std::vector<VertexId> between;
    for (int i = 0; i < 20; ++i) {
      Delaunay3<double>::Point p;
      for (double& c : p) c = scale * (static_cast<double>(random() % 16) / 2 - 3.25);
      if (i % 4 == 0) p[0] = std::nextafter(p[0], 0);
      points.push_back(p);
      between.push_back(triangulation.insert(p).vertex);
    }
    const auto cgal_points = to_cgal(points);
    expect_equal_to_cgal(triangulation, Oracle3(cgal_points.begin(), cgal_points.end()));
    std::sort(between.begin(), between.end());
    between.erase(std::unique(between.begin(), between.end()), between.end());
    triangulation.remove(std::span<const VertexId>(between));
    points.resize(300);
    const auto fewer = to_cgal(points);
    expect_equal_to_cgal(triangulation, Oracle3(fewer.begin(), fewer.end()));
  }
}

/// A filter's verdict on the fifth point must be right, even if exact arithmetic finds it on the
/// sphere of the others (which are not coplanar). The filter may leave anything undecided.
template <class Ours>
spatial::Verdict expect_right_verdict(std::array<typename Ours::Point, 5> p, int turn, int side) {
  if (turn < 0) {
    std::swap(p[0], p[1]);
    side = -side;
  }
  typename Ours::Lattice lattice;
  for (const auto& point : p) lattice.add(point);
  const auto vertex = [&](std::size_t i) { return typename Ours::Vertex{p[i], 0}; };
  const spatial::Verdict verdict =
      typename Ours::Probe(p[4], lattice).side(vertex(0), vertex(1), vertex(2), vertex(3));
  const bool inside =
      side != 0 ? side > 0 : spatial::inside_perturbed_sphere<Ours>(p[0], p[1], p[2], p[3], p[4]);
  if (verdict != spatial::Verdict::open) {
    EXPECT_EQ(verdict == spatial::Verdict::in, inside);
  }
  return verdict;
}
template <class Point>
bool is_new(const std::array<Point, 5>& p) {
  return std::find(p.begin(), p.begin() + 4, p[4]) == p.begin() + 4;
}

/// Compares signs of the kernel for doubles with exact rational arithmetic.
using Exact = CGAL::Exact_predicates_exact_constructions_kernel;
Exact::Point_3 exact(const std::array<double, 3>& p) { return {p[0], p[1], p[2]}; }

void expect_exact_signs(const std::array<std::array<double, 3>, 5>& p, bool decided) {
  using Ours = spatial::DoubleKernel;
  const std::array<Exact::Point_3, 5> q = {exact(p[0]), exact(p[1]), exact(p[2]), exact(p[3]),
                                           exact(p[4])};
  const int turn = CGAL::orientation(q[0], q[1], q[2], q[3]);
  ASSERT_EQ(Ours::orientation(p[0], p[1], p[2], p[3]), turn);
  ASSERT_EQ(Ours::collinear(p[0], p[1], p[2]), CGAL::collinear(q[0], q[1], q[2]));
  if (turn != 0) {
    const int side = CGAL::side_of_oriented_sphere(q[0], q[1], q[2], q[3], q[4]);
    ASSERT_EQ(Ours::in_sphere(p[0], p[1], p[2], p[3], p[4]), side);
    if (is_new(p)) {
      const spatial::Verdict verdict = expect_right_verdict<Ours>(p, turn, side);
      ASSERT_FALSE(decided && verdict == spatial::Verdict::open);
    }
  }
  ASSERT_EQ(Ours::compare_distance(p[0], p[1], p[2]),
            static_cast<int>(CGAL::compare_distance_to_point(q[0], q[1], q[2])));
}

TEST(DoubleKernel3, SignsAreExact) {
  std::mt19937_64 random(5);
  for (int round = 0; round < 20'000; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    // Points on a small raster, moved far out, scaled, and perturbed in the last bits: from easy to
    // undecidable in doubles. The filter must decide those that are neither perturbed nor scaled
    // too far.
    const int exponent = static_cast<int>(random() % (round % 2 == 0 ? 2000 : 180));
    const double scale = std::ldexp(1.0, exponent - (round % 2 == 0 ? 1000 : 90));
    const double offset = round % 3 == 0 ? 0 : std::ldexp(scale, static_cast<int>(random() % 20));
    const bool disturbed = round % 5 < 3;
    std::array<std::array<double, 3>, 5> p;
    for (auto& point : p) {
      for (double& c : point) {
        c = offset + scale * static_cast<double>(random() % 8);
        if (disturbed && random() % 4 == 0)
          c = std::nextafter(c, random() % 2 == 0 ? -1e300 : 1e300);
      }
    }
    expect_exact_signs(p, !disturbed && scale > 0x1p-78 && scale < 0x1p78);
    if (::testing::Test::HasFatalFailure()) return;
  }
}

TEST(IntKernel3, SignsAreExact) {
  using Ours = spatial::IntKernel;
  std::mt19937_64 random(6);
  for (int round = 0; round < 20'000; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    // From small rasters to the full range, nearly cospherical or not.
    const std::uint64_t bound = std::uint64_t{1} << (1 + random() % 30);
    std::array<Ours::Point, 5> p;
    std::array<Exact::Point_3, 5> q;
    for (std::size_t i = 0; i < 5; ++i) {
      for (auto& c : p[i]) {
        c = static_cast<std::int32_t>(random() % std::min<std::uint64_t>(bound, 8));
        if (random() % 2 == 0) c = static_cast<std::int32_t>(bound - 1) - c;
        c = std::max(c, 0);
        if (round % 2 == 0) c = static_cast<std::int32_t>(random() % bound);
      }
      q[i] = Exact::Point_3(p[i][0], p[i][1], p[i][2]);
    }
    const int turn = CGAL::orientation(q[0], q[1], q[2], q[3]);
    ASSERT_EQ(Ours::orientation(p[0], p[1], p[2], p[3]), turn);
    ASSERT_EQ(Ours::collinear(p[0], p[1], p[2]), CGAL::collinear(q[0], q[1], q[2]));
    ASSERT_EQ(Ours::compare_distance(p[0], p[1], p[2]),
              static_cast<int>(CGAL::compare_distance_to_point(q[0], q[1], q[2])));
    if (turn == 0) continue;
    const int side = CGAL::side_of_oriented_sphere(q[0], q[1], q[2], q[3], q[4]);
    ASSERT_EQ(Ours::in_sphere(p[0], p[1], p[2], p[3], p[4]), side);
    if (!is_new(p)) continue;
    const spatial::Verdict verdict = expect_right_verdict<Ours>(p, turn, side);
    ASSERT_FALSE(bound <= 512 && verdict == spatial::Verdict::open);
  }
}

}  // namespace
}  // namespace terrace::tri
