// SPDX-License-Identifier: Apache-2.0
// Compares the triangles around a point with those of the triangulation of all points.
#include "surface/point_star.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/tri/delaunay2.hpp>

namespace terrace::terrain {
namespace {

/// Returns the neighbours, counter-clockwise from the least; of an open star, from the hull's
/// first.
std::vector<Point2> neighbours_of(const PointStar& star) {
  std::vector<Point2> result;
  for (std::size_t i = 0; i < star.size(); ++i) result.push_back(star.neighbour(i));
  if (star.is_closed()) {
    std::rotate(result.begin(), std::min_element(result.begin(), result.end()), result.end());
  }
  return result;
}

/// The same from the whole triangulation; closed: whether triangles surround the centre.
std::vector<Point2> neighbours_in(const tri::Delaunay2<double>& whole, const Point2& centre,
                                  bool& closed) {
  std::vector<std::array<Point2, 2>> edges;  // of the triangles, opposite to the centre
  for (const tri::TriangleId t : whole.all_triangles()) {
    const auto v = whole.vertices(t);
    for (std::size_t i = 0; i < 3; ++i) {
      if (whole.point(v[i]) != centre) continue;
      edges.push_back({whole.point(v[(i + 1) % 3]), whole.point(v[(i + 2) % 3])});
    }
  }
  const auto from = [&](const Point2& p) {
    return std::find_if(edges.begin(), edges.end(), [&](const auto& e) { return e[0] == p; });
  };
  const auto is_end = [&](const Point2& p) {
    return std::any_of(edges.begin(), edges.end(), [&](const auto& e) { return e[1] == p; });
  };
  auto start = std::min_element(edges.begin(), edges.end());
  const auto first =
      std::find_if(edges.begin(), edges.end(), [&](const auto& e) { return !is_end(e[0]); });
  closed = first == edges.end();
  if (!closed) start = first;
  std::vector<Point2> result{(*start)[0]};
  for (auto at = start;;) {
    const Point2 next = (*at)[1];
    if (closed && next == result.front()) break;
    result.push_back(next);
    at = from(next);
    if (at == edges.end()) break;
  }
  return result;
}

std::vector<Point2> cloud(const std::string& kind, std::mt19937_64& engine) {
  const auto below = [&](std::uint64_t n) { return static_cast<double>(engine() % n); };
  const auto unit = [&] { return static_cast<double>(engine() >> 11) * 0x1p-53; };
  std::vector<Point2> points;
  for (int i = 0; i < 150; ++i) {
    if (kind == "random") points.push_back({unit(), unit()});
    if (kind == "lattice") points.push_back({below(9), below(7)});
    if (kind == "circle") {
      const double t = 0.1 * static_cast<double>(i);
      points.push_back({1000 * std::cos(t), 1000 * std::sin(t)});
    }
    // Integer points on one circle, and some inside.
    if (kind == "cocircular") {
      const int a = i % 4 < 2 ? 1 : -1, b = i % 2 == 0 ? 1 : -1;
      const std::array<std::array<int, 2>, 5> at{{{0, 65}, {16, 63}, {25, 60}, {33, 56}, {39, 52}}};
      const auto& p = at[static_cast<std::size_t>(i / 4) % 5];
      points.push_back({static_cast<double>(a * p[0]), static_cast<double>(b * p[1])});
      if (i < 6) points.push_back({below(20) - 10, below(20) - 10});
    }
    if (kind == "nearly a line") points.push_back({below(60), i == 75 ? 1.0 : 0.0});
  }
  return points;
}

class Stars : public testing::TestWithParam<std::string> {};

TEST_P(Stars, MatchTriangulation) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 engine(seed);
    std::vector<Point2> points = cloud(GetParam(), engine);
    std::shuffle(points.begin(), points.end(), engine);
    tri::Delaunay2<double> whole;
    for (const Point2& p : points) whole.insert(p);
    ASSERT_GT(whole.triangle_count(), 0U);
    PointStar star;
    for (const Point2& centre : points) {
      star.start(centre);
      for (const Point2& p : points) star.offer(p);
      for (std::size_t i = 0; i < 5; ++i) star.offer(points[i]);  // again, without effect
      bool closed = false;
      const std::vector<Point2> expected = neighbours_in(whole, centre, closed);
      ASSERT_EQ(star.is_closed(), closed);
      ASSERT_EQ(neighbours_of(star), expected);
      ASSERT_EQ(star.triangles(), expected.size() - (closed ? 0 : 1));
      ASSERT_TRUE(star.has_centre());
    }
  }
}

INSTANTIATE_TEST_SUITE_P(PointStar, Stars,
                         testing::Values("random", "lattice", "circle", "cocircular",
                                         "nearly a line"),
                         [](const auto& one) {
                           std::string name = one.param;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

TEST(PointStar, HasNoTriangleForCollinearPoints) {
  PointStar star;
  star.start({0, 0});
  EXPECT_EQ(star.triangles(), 0U);
  EXPECT_FALSE(star.is_closed());
  for (int i = -3; i <= 3; ++i) star.offer({static_cast<double>(i), static_cast<double>(2 * i)});
  EXPECT_EQ(star.triangles(), 0U);
  EXPECT_FALSE(star.is_closed());
  star.offer({0, 5});
  EXPECT_EQ(star.triangles(), 2U);
  EXPECT_FALSE(star.is_closed());
  star.offer({5, 0});
  EXPECT_TRUE(star.is_closed());
  EXPECT_EQ(star.triangles(), 4U);
}

}  // namespace
}  // namespace terrace::terrain
