// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "point_tin_oracle.hpp"
#include "terrace/tri/point_tin.hpp"
#include "tin/point/mesh.hpp"

namespace terrace::tri {
namespace {

using namespace point_tin_oracle;

std::vector<Point3> square_frame(double size, std::size_t per_side, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Point3> frame;
  const auto steps = static_cast<double>(per_side);
  for (std::size_t side = 0; side < 4; ++side) {
    for (std::size_t k = 0; k < per_side; ++k) {
      const double t = std::floor(static_cast<double>(k) / steps * size);
      const double height = 20 * to_unit(random());
      if (side == 0) frame.push_back({t, 0, height});
      if (side == 1) frame.push_back({size, t, height});
      if (side == 2) frame.push_back({size - t, size, height});
      if (side == 3) frame.push_back({0, size - t, height});
    }
  }
  return frame;
}

TEST(PointTin, KeepsTheFrame) {
  for (const std::uint64_t seed : {5u, 6u, 7u}) {
    for (const TinQuality quality : kQualities) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", quality " +
                   std::to_string(static_cast<int>(quality)));
      const std::vector<Point3> frame = square_frame(1000, 1 + 6 * (seed - 5), seed);
      Cloud cloud;
      std::mt19937_64 random(seed);
      std::size_t inside = 0;
      for (std::size_t i = 0; i < 3000; ++i) {
        const double x = 1200 * to_unit(random()) - 100;
        const double y = 1200 * to_unit(random()) - 100;
        inside += x >= 0 && x <= 1000 && y >= 0 && y <= 1000 ? 1 : 0;
        cloud.add(x, y, rough(x / 1000, y / 1000));
      }
      // Slightly outside and on the sides, where the frame determines the heights.
      cloud.add(500, std::nextafter(1000.0, 2000.0), 0);
      cloud.add(std::nextafter(0.0, -1.0), 20, 0);
      cloud.add(500, 1000, 500);
      cloud.add(0, 0, -300);
      inside += 2;
      PointTinOptions options;
      options.max_error = 2;
      options.quality = quality;
      const PointTin tin = make(cloud, frame, options);
      check_frame(tin, frame);
      EXPECT_EQ(tin.errors.covered, inside);
      EXPECT_EQ(tin.errors.uncovered, cloud.size() - inside);
      EXPECT_EQ(tin.stuck, 2u);
      EXPECT_GT(tin.errors.largest, 300);
      const TinErrors measured = measure(cloud, tin);
      EXPECT_EQ(measured.covered, inside);
      EXPECT_NEAR(measured.largest, tin.errors.largest, 1e-9);
      // All except these two must keep the error.
      cloud.z[cloud.size() - 1] = frame[0][2];
      cloud.x[cloud.size() - 2] = 2000;
      EXPECT_LE(measure(cloud, tin).largest, 2 + 1e-9);
      if (quality == TinQuality::greedy) check_delaunay(tin);
    }
  }
}

TEST(PointTin, KeepsTheErrorOnALattice) {
  for (const double size : {40.0, 300.0, 32767.0}) {
    for (const TinQuality quality : kQualities) {
      SCOPED_TRACE("size " + std::to_string(size) + ", quality " +
                   std::to_string(static_cast<int>(quality)));
      const std::vector<Point3> frame = square_frame(size, 5, 8);
      Cloud cloud;
      std::mt19937_64 random(8);
      for (std::size_t i = 0; i < 4000; ++i) {
        const double x = (1.02 * to_unit(random()) - 0.01) * size;
        const double y = (1.02 * to_unit(random()) - 0.01) * size;
        cloud.add(x, y, rough(x / size, y / size));
      }
      PointTinOptions options;
      options.max_error = 1.5;
      options.quality = quality;
      options.lattice = TinLattice{-100, 0.01};
      const PointTin tin = make(cloud, frame, options);
      check_frame(tin, frame);
      for (std::size_t v = frame.size(); v < tin.vertices.size(); ++v) {
        const Point3& p = tin.vertices[v];
        EXPECT_EQ(p[0], std::floor(p[0]));
        EXPECT_EQ(p[1], std::floor(p[1]));
        const double steps = (p[2] + 100) / 0.01;
        EXPECT_NEAR(steps, std::round(steps), 1e-6);
        EXPECT_EQ(p[0], std::floor(cloud.x[tin.sample[v]] + 0.5));
        EXPECT_EQ(p[1], std::floor(cloud.y[tin.sample[v]] + 0.5));
      }
      const TinErrors measured = measure(cloud, tin);
      EXPECT_EQ(measured.covered, tin.errors.covered);
      EXPECT_NEAR(measured.largest, tin.errors.largest, 1e-9);
      // A coarse lattice cannot represent the terrain and must report it.
      if (tin.stuck == 0) {
        EXPECT_LE(tin.errors.largest, 1.5);
      } else {
        EXPECT_GT(tin.errors.largest, 1.5);
      }
      std::size_t above = 0;
      for (std::size_t i = 0; i < cloud.size(); ++i) {
        const Cloud one{{cloud.x[i]}, {cloud.y[i]}, {cloud.z[i]}};
        above += i < 400 && measure(one, tin).largest > 1.5 ? 1 : 0;
      }
      EXPECT_LE(above, tin.stuck);
    }
  }
}

/// With few different integers many positions are collinear or cocircular.
TEST(PointTin, IntegerPredicatesAgreeWithThoseOfDoubles) {
  using tin::points::Kernel, tin::points::Place2, tin::points::SmallIntegerKernel;
  std::mt19937_64 random(9);
  std::array<std::size_t, 2> ties{};
  for (const std::uint64_t size : {4u, 30u, 1000u, 32768u}) {
    for (int i = 0; i < 20000; ++i) {
      std::array<Place2, 4> p;
      for (Place2& place : p) {
        for (double& c : place) {
          c = static_cast<double>(random() % (size + 1));
          // The corners of the largest square give the largest products.
          if (i % 4 == 0) c = c < static_cast<double>(size) / 2 ? 0 : static_cast<double>(size);
        }
      }
      const int side = Kernel::orientation(p[0], p[1], p[2]);
      ASSERT_EQ(SmallIntegerKernel::orientation(p[0], p[1], p[2]), side);
      ties[0] += side == 0 ? 1 : 0;
      if (side <= 0) continue;
      const int inside = Kernel::in_circle(p[0], p[1], p[2], p[3]);
      ASSERT_EQ(SmallIntegerKernel::in_circle(p[0], p[1], p[2], p[3]), inside);
      ties[1] += inside == 0 ? 1 : 0;
    }
  }
  EXPECT_GT(ties[0], 1000U);
  EXPECT_GT(ties[1], 1000U);
}

/// The first vertices have more triangles than a word has bits.
TEST(PointTin, KeepsTheErrorInAFrameOfManyVertices) {
  for (const std::uint64_t seed : {1u, 2u}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const std::vector<Point3> frame = square_frame(32767, 700, seed);
    Cloud cloud;
    std::mt19937_64 random(seed);
    for (std::size_t i = 0; i < 6000; ++i) {
      const double x = 32767 * to_unit(random()), y = 32767 * to_unit(random());
      cloud.add(x, y, 20 * to_unit(random()));
    }
    PointTinOptions options;
    options.max_error = 3;
    options.lattice = TinLattice{0.0, 0x1p-8};
    const PointTin tin = make(cloud, frame, options);
    check_frame(tin, frame);
    const TinErrors errors =
        measure_surface(cloud.x, cloud.y, cloud.z, tin.vertices, tin.triangles);
    EXPECT_EQ(errors.covered, cloud.x.size());
    EXPECT_NEAR(errors.largest, tin.errors.largest, 1e-9);
    EXPECT_TRUE(tin.stuck > 0 || errors.largest <= options.max_error) << errors.largest;
    EXPECT_LT(tin.stuck, 20U);
    EXPECT_GT(tin.removed, 0U);
  }
}

TEST(PointTin, ReportsLatticesTooCoarseForTheError) {
  Cloud cloud;
  std::mt19937_64 random(9);
  for (std::size_t i = 0; i < 2000; ++i)
    cloud.add(20 * to_unit(random()), 20 * to_unit(random()), 100 * to_unit(random()));
  PointTinOptions options;
  options.lattice = TinLattice{0, 5};
  const std::vector<Point3> frame{{0, 0, 0}, {20, 0, 0}, {20, 20, 0}, {0, 20, 0}};
  for (const TinQuality quality : kQualities) {
    options.quality = quality;
    const PointTin tin = make(cloud, frame, options);
    check_frame(tin, frame);
    EXPECT_GT(tin.stuck, 0u);
    EXPECT_GT(tin.errors.largest, 0);
    EXPECT_NEAR(measure(cloud, tin).largest, tin.errors.largest, 1e-9);
  }
}

}  // namespace
}  // namespace terrace::tri
