// SPDX-License-Identifier: GPL-3.0-or-later
#include "scan/cgal_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace terrace::tools {
namespace {

/// Returns points on a Fibonacci spiral around (10, 0, 0), in random order.
std::vector<tri::Point3> sphere(std::size_t count) {
  std::vector<tri::Point3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double radius = std::sqrt(1 - z * z);
    const double angle = static_cast<double>(i) * std::numbers::pi * (3 - std::sqrt(5.0));
    points.push_back({10 + radius * std::cos(angle), radius * std::sin(angle), z});
  }
  std::shuffle(points.begin(), points.end(), std::mt19937_64(4));
  return points;
}

/// Expects a closed manifold of one part without holes.
void expect_sphere(const tri::Surface& surface) {
  const tri::SurfaceMeasures measures = tri::measure(surface);
  EXPECT_TRUE(measures.closed);
  EXPECT_EQ(measures.components, 1u);
  EXPECT_EQ(measures.euler_characteristic, 2);
  EXPECT_EQ(measures.non_manifold_edges, 0u);
  EXPECT_EQ(measures.vertices, surface.points.size());
}

double volume_ratio(const tri::Surface& surface) {
  return tri::measure(surface).volume / (4 * std::numbers::pi / 3);
}

TEST(CgalSurfaceTest, AdvancingFrontRestoresASphere) {
  std::vector<tri::Point3> points = sphere(1500);
  points.push_back(points[0]);
  const tri::RestoredSurface result = advancing_front_surface(points);
  expect_sphere(result.surface);
  EXPECT_NEAR(volume_ratio(result.surface), 1.0, 0.02);
  ASSERT_EQ(result.input.size(), 1500u);
  for (std::size_t i = 0; i < result.input.size(); ++i) {
    ASSERT_EQ(result.surface.points[i], points[result.input[i]]);
  }
  EXPECT_EQ(advancing_front_surface(points).surface.faces.size(), result.surface.faces.size());
}

TEST(CgalSurfaceTest, AlphaWrapEnclosesThePointsInASphere) {
  const std::vector<tri::Point3> points = sphere(1500);
  const tri::Surface result = alpha_wrap_surface(points);
  expect_sphere(result);
  EXPECT_GT(volume_ratio(result), 1.0);
  EXPECT_LT(volume_ratio(result), 1.25);
  const tri::Surface again = alpha_wrap_surface(points);
  EXPECT_TRUE(again.faces == result.faces);
  EXPECT_TRUE(again.points == result.points);
}

TEST(CgalSurfaceTest, HandlesDegeneratePoints) {
  const std::vector<tri::Point3> equal(5, tri::Point3{1, 2, 3});
  EXPECT_TRUE(advancing_front_surface({}).surface.faces.empty());
  EXPECT_TRUE(alpha_wrap_surface({}).faces.empty());
  EXPECT_TRUE(advancing_front_surface(equal).surface.faces.empty());
  EXPECT_TRUE(alpha_wrap_surface(equal).faces.empty());
  std::vector<tri::Point3> line, plane, grid;
  for (int i = 0; i < 60; ++i) {
    const double x = i % 4, y = i / 4 % 4, z = i / 16;
    line.push_back({x, 3 * x + 1, 2 * x});
    plane.push_back({x, y, x + 2 * y});
    grid.push_back({x, y, z});
  }
  for (const auto& flat : {line, plane}) {
    EXPECT_TRUE(advancing_front_surface(flat).surface.faces.empty());
    tri::measure(alpha_wrap_surface(flat));
  }
  tri::measure(advancing_front_surface(grid).surface);
  tri::measure(alpha_wrap_surface(grid));
}

TEST(CgalSurfaceTest, ErrorsNameUnsupportedPoints) {
  const auto expect_rejected = [](const std::vector<tri::Point3>& points, const char* message) {
    try {
      alpha_wrap_surface(points);
      ADD_FAILURE() << "not rejected: " << message;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
    }
    EXPECT_THROW(advancing_front_surface(points), std::invalid_argument);
  };
  std::vector<tri::Point3> points = sphere(10);
  for (const double invalid : {std::numeric_limits<double>::quiet_NaN(), -1e101}) {
    points[7][1] = invalid;
    expect_rejected(points, "point 7");
  }
  points = sphere(10);
  for (auto& p : points) p = {(p[0] - 10) * 1e-120, p[1] * 1e-120, p[2] * 1e-120};
  expect_rejected(points, "1e-100");
}

}  // namespace
}  // namespace terrace::tools
