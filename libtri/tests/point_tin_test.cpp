// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/point_tin.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "point_tin_oracle.hpp"

namespace terrace::tri {
namespace {

using namespace point_tin_oracle;

TEST(PointTin, KeepsTheErrorOverTheHull) {
  for (const PointSet kind : kPointSets) {
    if (kind == PointSet::huge || kind == PointSet::tiny) continue;
    for (std::uint64_t seed = 1; seed <= 2; seed += TERRACE_TEST_SHARE) {
      const Cloud cloud = make_cloud(kind, 800, seed);
      for (const double error : {0.0, 0.5, 5.0, 200.0}) {
        for (const TinQuality quality : kQualities) {
          SCOPED_TRACE(name(kind) + ", seed " + std::to_string(seed) + ", error " +
                       std::to_string(error) + ", quality " +
                       std::to_string(static_cast<int>(quality)));
          PointTinOptions options;
          options.max_error = error;
          options.quality = quality;
          const PointTin tin = make(cloud, {}, options);
          EXPECT_EQ(tin.duplicates, cloud.size() - cloud.places());
          check_mesh(tin);
          if (tin.triangles.empty()) {
            EXPECT_TRUE(kind == PointSet::horizontal || kind == PointSet::slanted);
            EXPECT_EQ(tin.errors.uncovered, cloud.places());
            continue;
          }
          EXPECT_EQ(tin.errors.uncovered, 0u);
          EXPECT_EQ(tin.errors.covered, cloud.places());
          EXPECT_EQ(tin.stuck, 0u);
          EXPECT_LE(tin.errors.largest, error);
          const TinErrors measured = measure(cloud, tin);
          EXPECT_EQ(measured.covered, cloud.size());
          EXPECT_LE(measured.largest, error + 1e-9);
          EXPECT_NEAR(measured.largest, tin.errors.largest, 1e-9);
          if (quality == TinQuality::greedy) {
            check_delaunay(tin);
            EXPECT_EQ(tin.removed, 0u);
          }
          if (quality != TinQuality::fitted) {
            for (std::size_t v = 0; v < tin.vertices.size(); ++v) {
              const std::uint32_t s = tin.sample[v];
              ASSERT_LT(s, cloud.size());
              EXPECT_EQ(tin.vertices[v], (Point3{cloud.x[s], cloud.y[s], cloud.z[s]}));
            }
          }
        }
      }
    }
  }
}

// So many samples that a few of them choose the first vertices, and the last vertices are inserted
// in parts.
TEST(PointTin, KeepsTheErrorOfManySamples) {
  for (const PointSet kind : {PointSet::uniform, PointSet::grid, PointSet::clusters}) {
    const Cloud cloud = make_cloud(kind, 70000, 17);
    for (const double error : {0.6, 10.0}) {
      for (const TinQuality quality : kQualities) {
        SCOPED_TRACE(name(kind) + ", error " + std::to_string(error) + ", quality " +
                     std::to_string(static_cast<int>(quality)));
        PointTinOptions options;
        options.max_error = error;
        options.quality = quality;
        const PointTin tin = make(cloud, {}, options);
        check_mesh(tin);
        EXPECT_LE(tin.errors.largest, error);
        const TinErrors measured = measure(cloud, tin);
        EXPECT_EQ(measured.uncovered, 0u);
        EXPECT_LE(measured.largest, error + 1e-9);
        EXPECT_GE(tin.vertices.size(), 3 + tin.inserted - tin.removed);
      }
    }
  }
}

TEST(PointTin, MeasureSurfaceAgreesWithBruteForce) {
  for (const PointSet kind : {PointSet::uniform, PointSet::seven_bits, PointSet::clusters}) {
    for (const std::uint64_t seed : {3u, 4u}) {
      SCOPED_TRACE(name(kind) + ", seed " + std::to_string(seed));
      PointTinOptions options;
      options.max_error = 8;
      const PointTin tin = make(make_cloud(kind, 600, seed), {}, options);
      // Other samples, many of them outside.
      const Cloud other = make_cloud(kind, 900, seed + 10);
      const TinErrors fast = measure(other, tin);
      const TinErrors slow = brute_force(other, tin);
      EXPECT_EQ(fast.covered, slow.covered);
      EXPECT_EQ(fast.uncovered, slow.uncovered);
      EXPECT_NEAR(fast.largest, slow.largest, 1e-8 * (1 + slow.largest));
      EXPECT_NEAR(fast.rms, slow.rms, 1e-8 * (1 + slow.rms));
    }
  }
}

TEST(PointTin, LimitsThePoints) {
  const Cloud cloud = make_cloud(PointSet::uniform, 3000, 12);
  double before = std::numeric_limits<double>::infinity();
  for (const std::size_t points : {50u, 200u, 800u}) {
    double greedy = 0;
    for (const TinQuality quality : kQualities) {
      SCOPED_TRACE(std::to_string(points) + " points, quality " +
                   std::to_string(static_cast<int>(quality)));
      PointTinOptions options;
      options.max_points = points;
      options.quality = quality;
      const PointTin tin = make(cloud, {}, options);
      check_mesh(tin);
      EXPECT_LE(tin.vertices.size(), points);
      EXPECT_GE(tin.vertices.size(), points * 98 / 100);
      EXPECT_NEAR(tin.errors.largest, measure(cloud, tin).largest, 1e-9);
      if (quality == TinQuality::greedy) greedy = tin.errors.largest;
      EXPECT_LE(tin.errors.largest, greedy);
    }
    EXPECT_LT(greedy, before);
    before = greedy;
  }
  // The error limit applies if it allows fewer vertices.
  PointTinOptions options;
  options.max_error = 30;
  const PointTin free = make(cloud, {}, options);
  options.max_points = 2000;
  EXPECT_EQ(make(cloud, {}, options).vertices, free.vertices);
  // The hull's corners stay.
  options.max_points = 1;
  EXPECT_GE(make(cloud, {}, options).vertices.size(), 3u);
}

// The number of vertices falls steeply with the bound, as for trees over flat ground.
TEST(PointTin, UsesNearlyAllMaxPointsOnSpikes) {
  Cloud cloud = make_cloud(PointSet::uniform, 6000, 14);
  std::mt19937_64 random(14);
  for (double& z : cloud.z)
    z = random() % 4 == 0 ? 20 + static_cast<double>(random() % 500) / 100 : 0.0;
  for (const std::size_t points : {100u, 300u, 1000u}) {
    SCOPED_TRACE(points);
    PointTinOptions options;
    options.max_points = points;
    const PointTin tin = make(cloud, {}, options);
    EXPECT_LE(tin.vertices.size(), points);
    if (tin.vertices.size() >= points * 98 / 100) continue;
    // Then a bound that is a little smaller must give more.
    options.max_points = 0;
    options.max_error = tin.errors.largest * 0.99;
    EXPECT_GT(make(cloud, {}, options).vertices.size(), points);
  }
}

TEST(MeasureSurface, NamesTheLeastPositionAmongEqualErrors) {
  const std::vector<Point3> vertices{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}};
  const std::vector<std::array<std::uint32_t, 3>> triangles{{0, 1, 2}};
  const std::vector<double> x{3, 1, 2, 1}, y{1, 2, 1, 1}, z{5, -5, 5, 4};
  EXPECT_EQ(measure_surface(x, y, z, vertices, triangles).largest_at, 1u);
  const std::vector<double> back_x{1, 2, 1, 3}, back_y{1, 1, 2, 1}, back_z{4, 5, -5, 5};
  EXPECT_EQ(measure_surface(back_x, back_y, back_z, vertices, triangles).largest_at, 2u);
}

TEST(PointTin, ResultDoesNotDependOnTheOrderOfSamples) {
  // All positions differ, so the order along the curve is the same, and so is everything else.
  const Cloud cloud = make_cloud(PointSet::uniform, 4000, 13);
  Cloud shuffled = cloud;
  std::mt19937_64 random(13);
  for (std::size_t i = cloud.size(); i-- > 1;) {
    const std::size_t k = random() % (i + 1);
    std::swap(shuffled.x[i], shuffled.x[k]);
    std::swap(shuffled.y[i], shuffled.y[k]);
    std::swap(shuffled.z[i], shuffled.z[k]);
  }
  for (const TinQuality quality : kQualities) {
    PointTinOptions options;
    options.max_error = 1;
    options.quality = quality;
    const PointTin a = make(cloud, {}, options);
    const PointTin b = make(cloud, {}, options);
    EXPECT_EQ(a.vertices, b.vertices);
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_EQ(a.sample, b.sample);
    const PointTin c = make(shuffled, {}, options);
    EXPECT_EQ(c.vertices, a.vertices);
    EXPECT_EQ(c.triangles, a.triangles);
  }
}

TEST(PointTin, PlanesNeedNoVertices) {
  Cloud cloud;
  std::mt19937_64 random(14);
  for (std::size_t i = 0; i < 2000; ++i) {
    const double x = static_cast<double>(random() % 1024);
    const double y = static_cast<double>(random() % 1024);
    cloud.add(x, y, 3 * x - 2 * y + 7);
  }
  for (const double x : {-1.0, 1024.0})
    for (const double y : {-1.0, 1024.0}) cloud.add(x, y, 3 * x - 2 * y + 7);
  PointTinOptions options;
  options.max_error = 1e-9;
  const PointTin tin = make(cloud, {}, options);
  EXPECT_EQ(tin.triangles.size(), 2u);
}

TEST(PointTin, BetterQualityMeansFewerTriangles) {
  const Cloud cloud = make_cloud(PointSet::uniform, 20000, 15);
  std::size_t triangles[3];
  for (std::size_t q = 0; q < 3; ++q) {
    PointTinOptions options;
    options.max_error = 2;
    options.quality = kQualities[q];
    triangles[q] = make(cloud, {}, options).triangles.size();
  }
  EXPECT_LT(static_cast<double>(triangles[1]), 0.8 * static_cast<double>(triangles[0]));
  EXPECT_LT(static_cast<double>(triangles[2]), 0.97 * static_cast<double>(triangles[1]));
}

}  // namespace
}  // namespace terrace::tri
