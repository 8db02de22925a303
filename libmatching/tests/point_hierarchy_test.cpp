// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/point_hierarchy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "matching_oracles.hpp"
#include "tree_oracles.hpp"

namespace terrace::matching {
namespace {

using oracles::uniform;

/// Draws points that are uniform, on a small grid (ties and duplicates), on a line, or far from the
/// origin.
template <std::size_t D>
std::array<double, D> draw(std::uint64_t kind, std::mt19937_64& random) {
  std::array<double, D> p;
  for (std::size_t d = 0; d < D; ++d) {
    p[d] = uniform(random);
    if (kind == 1) p[d] = std::floor(5.0 * p[d]);
    if (kind == 2 && d > 0) p[d] = 0.5;
    if (kind == 3) p[d] = 4.6e6 + 100.0 * p[d];
  }
  return p;
}

template <std::size_t D>
void test_nearest(std::uint64_t seed) {
  SCOPED_TRACE(testing::Message() << "seed " << seed << " dimension " << D);
  std::mt19937_64 random(seed);
  const std::uint64_t kind = seed % 4;
  std::vector<std::array<double, D>> points(1 + random() % 200);
  for (auto& p : points) p = draw<D>(kind, random);
  const std::size_t n = points.size();
  const std::vector<std::vector<TreeChildren>> trees{
      oracles::matching_rows(points), oracles::random_tree(n, random), oracles::chain_tree(n)};
  std::vector<PointHierarchy<D>> hierarchies;
  for (std::uint32_t k = 0; k < trees.size(); ++k) {
    HierarchyOptions options = kPointLeaves;
    options.leaf_size = 1 + 3 * k;
    hierarchies.emplace_back(trees[k], points, options);
  }
  for (int q = 0; q < 40; ++q) {
    auto query = q % 4 == 0 ? points[random() % n] : draw<D>(kind, random);
    if (q % 8 == 7) query[0] += 1e3 * (uniform(random) - 0.5);
    const auto all = oracles::by_distance(points, query);
    const std::size_t k = random() % (n + 2);
    for (const auto& hierarchy : hierarchies) {
      EXPECT_EQ(hierarchy.nearest(query), all[0]);
      std::vector<Neighbour> found(3);
      hierarchy.nearest(query, k, found);
      ASSERT_EQ(found.size(), std::min(k, n));
      EXPECT_TRUE(std::equal(found.begin(), found.end(), all.begin()));
    }
  }
}

TEST(PointHierarchy, FindsTheNearest) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    test_nearest<2>(seed);
    test_nearest<3>(seed);
  }
}

TEST(PointHierarchy, HandlesAnyScaleAndDepth) {
  std::mt19937_64 random(8);
  std::vector<Point3> plain(150);
  for (Point3& p : plain) p = draw<3>(0, random);
  const PointHierarchy<3> usual(oracles::matching_rows(plain), plain);
  for (const int exponent : {-1000, -300, 300, 1000}) {
    SCOPED_TRACE(testing::Message() << "2^" << exponent);
    const auto scaled = [&](Point3 p) {
      for (double& c : p) c = std::ldexp(c, exponent);
      return p;
    };
    std::vector<Point3> points;
    for (const Point3& p : plain) points.push_back(scaled(p));
    const PointHierarchy<3> hierarchy(oracles::random_tree(points.size(), random), points);
    for (int q = 0; q < 30; ++q) {
      const Point3 query = draw<3>(0, random);
      const auto near = hierarchy.nearest(scaled(query)), expected = usual.nearest(query);
      EXPECT_EQ(near->index, expected->index);
      EXPECT_EQ(near->distance, std::ldexp(expected->distance, exponent));
      const Ray ray{query, {0.2, 0.3, -0.4}};
      const auto hit =
          hierarchy.hit({scaled(query), scaled(ray.direction)}, std::ldexp(0.1, exponent));
      EXPECT_EQ(hit, usual.hit(ray, 0.1));
    }
  }
  std::vector<Point2> line;
  for (int k = 0; k < 5000; ++k) line.push_back({std::sqrt(k), 0.0});
  HierarchyOptions single = kPointLeaves;
  single.leaf_size = 1;
  const PointHierarchy<2> deep(oracles::chain_tree(line.size()), line, single);
  EXPECT_EQ(deep.tree().depth(), 4999u);
  EXPECT_EQ(deep.nearest({10.0, 1.0})->index, 100u);
  EXPECT_EQ(deep.nearest({60.0, 1.0})->index, 3600u);
}

TEST(PointHierarchy, FindsTheFirstBall) {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const bool grid = seed % 3 == 0;
    std::vector<Point3> points(1 + random() % 200);
    for (Point3& p : points) p = draw<3>(grid ? 1 : 0, random);
    const double radius = grid ? 0.25 : 0.02 + 0.1 * uniform(random);
    const PointHierarchy<3> hierarchy(oracles::matching_rows(points), points);
    const PointHierarchy<3> other(oracles::random_tree(points.size(), random), points);
    for (int q = 0; q < 50; ++q) {
      Ray ray;
      for (std::size_t d = 0; d < 3; ++d) {
        ray.origin[d] = 4.0 * uniform(random) - 2.0;
        ray.direction[d] = draw<3>(0, random)[d] - (grid ? 0.0 : ray.origin[d]);
      }
      if (grid) {
        // Along an axis through the grid. Some rays are tangential.
        ray.origin = {-1.0, 0.25 * static_cast<double>(random() % 17),
                      0.25 * static_cast<double>(random() % 17)};
        ray.direction = {2.0, 0.0, -0.0};
      }
      if (q % 3 == 0) ray.t_min = uniform(random);
      if (q % 4 == 0) ray.t_max = 1.5 * uniform(random);
      const auto hit = hierarchy.hit(ray, radius);
      EXPECT_EQ(other.hit(ray, radius), hit);
      // A ray that is tangential up to rounding may hit or miss.
      RayHit sure, possible;
      sure.t = possible.t = std::numeric_limits<double>::infinity();
      for (std::uint32_t i = 0; i < points.size(); ++i) {
        const auto in = oracles::ball_entry(ray, points[i], radius * (1.0 - 1e-13));
        const auto out = oracles::ball_entry(ray, points[i], radius * (1.0 + 1e-13));
        if (in && *in < sure.t) sure = {i, *in};
        if (out && *out < possible.t) possible = {i, *out};
      }
      if (hit) {
        ++hits;
        EXPECT_GE(hit->t, possible.t - 1e-6);
        EXPECT_LE(hit->t, sure.t + 1e-6);
        const auto own = oracles::ball_entry(ray, points[hit->index], radius * (1.0 + 1e-13));
        ASSERT_TRUE(own);
        EXPECT_NEAR(hit->t, *own, 1e-6);
      } else {
        EXPECT_TRUE(std::isinf(sure.t)) << sure.index;
      }
    }
  }
  EXPECT_GT(hits, 500u);
}

TEST(PointHierarchy, HandlesFewerThanTwoPoints) {
  const PointHierarchy<3> none, built({}, std::vector<Point3>{});
  std::vector<Neighbour> found(2);
  for (const auto* hierarchy : {&none, &built}) {
    EXPECT_FALSE(hierarchy->nearest({1, 2, 3}));
    hierarchy->nearest({1, 2, 3}, 5, found);
    EXPECT_TRUE(found.empty());
    EXPECT_FALSE(hierarchy->hit({{0, 0, 0}, {1, 0, 0}}, 1.0));
  }
  const PointHierarchy<2> one({}, std::vector<Point2>{{3, 4}});
  EXPECT_EQ(one.nearest({0, 0}), (Neighbour{0, 5.0}));
}

TEST(PointHierarchy, RefusesBadQueries) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::vector<Point3> points{{0, 0, 0}, {1, 1, 1}};
  const PointHierarchy<3> hierarchy(std::vector<TreeChildren>{{0, 1}}, points);
  EXPECT_THROW((void)hierarchy.nearest({kNan, 0, 0}), std::invalid_argument);
  EXPECT_THROW((void)hierarchy.nearest({0, kInfinity, 0}), std::invalid_argument);
  EXPECT_THROW((void)hierarchy.nearest({0, 0, 1e200}), std::invalid_argument);
  const Ray good{{-1, 0, 0}, {1, 0, 0}};
  EXPECT_EQ(hierarchy.hit(good, 0.5), (RayHit{0, 0.5}));
  for (const double radius : {-1.0, kNan, kInfinity, 1e200}) {
    EXPECT_THROW((void)hierarchy.hit(good, radius), std::invalid_argument);
  }
  for (const Point3& direction : {Point3{0, 0, 0}, Point3{kNan, 1, 0}, Point3{kInfinity, 0, 0},
                                  Point3{1e305, 0, 0}, Point3{1e-305, 0, 0}}) {
    EXPECT_THROW((void)hierarchy.hit({good.origin, direction}, 0.5), std::invalid_argument);
  }
  EXPECT_THROW((void)hierarchy.hit({{kNan, 0, 0}, {1, 0, 0}}, 0.5), std::invalid_argument);
  EXPECT_THROW((void)hierarchy.hit({{0, 0, 0}, {1, 0, 0}, kNan, 1.0}, 0.5), std::invalid_argument);
  std::vector<Point3> bad = points;
  bad[1][2] = kNan;
  EXPECT_THROW(PointHierarchy<3>(std::vector<TreeChildren>{{0, 1}}, bad), std::invalid_argument);
}

}  // namespace
}  // namespace terrace::matching
