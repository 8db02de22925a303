// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "points3.hpp"
#include "terrace/tri/shape.hpp"

namespace terrace::tri {
namespace {

/// Points on a Fibonacci spiral, in random order.
std::vector<Point3> sphere(std::size_t count) {
  std::vector<Point3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double radius = std::sqrt(1 - z * z);
    const double angle = static_cast<double>(i) * std::numbers::pi * (3 - std::sqrt(5.0));
    points.push_back({10 + radius * std::cos(angle), radius * std::sin(angle), z});
  }
  std::shuffle(points.begin(), points.end(), std::mt19937_64(4));
  return points;
}

TEST(RestoreTest, RestoresASphere) {
  const std::vector<Point3> points = sphere(1500);
  const RestoredSurface found = restore_surface(points);
  const SurfaceMeasures measured = measure(found.surface);
  EXPECT_TRUE(measured.closed);
  EXPECT_EQ(measured.components, 1u);
  EXPECT_EQ(measured.euler_characteristic, 2);
  EXPECT_EQ(measured.non_manifold_edges, 0u);
  EXPECT_EQ(measured.vertices, found.surface.points.size());
  EXPECT_NEAR(measured.volume / (4 * std::numbers::pi / 3), 1.0, 0.02);
  ASSERT_EQ(found.input.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    ASSERT_EQ(found.surface.points[i], points[found.input[i]]);
  const RestoredSurface repeated = restore_surface(points);
  EXPECT_TRUE(repeated.surface.faces == found.surface.faces);
  EXPECT_TRUE(repeated.surface.points == found.surface.points);
}

TEST(RestoreTest, RoundedPointsGiveTheSameSurface) {
  const std::vector<Point3> points = sphere(1500);
  const SurfaceMeasures exact = measure(restore_surface(points).surface);
  for (const unsigned bits : {16u, 24u, 30u}) {
    RestoreOptions options;
    options.quantise_bits = bits;
    const RestoredSurface found = restore_surface(points, options);
    for (std::size_t i = 0; i < found.input.size(); ++i)
      ASSERT_EQ(found.surface.points[i], points[found.input[i]]);
    const SurfaceMeasures measured = measure(found.surface);
    EXPECT_EQ(measured.faces, exact.faces);
    EXPECT_NEAR(measured.volume, exact.volume, 1e-3);
    EXPECT_NEAR(measured.area, exact.area, 1e-2);
  }
}

TEST(RestoreTest, CoarseRoundingJoinsPoints) {
  RestoreOptions options;
  options.quantise_bits = 2;
  const RestoredSurface found = restore_surface(sphere(1500), options);
  EXPECT_LE(found.surface.points.size(), 64u);
  EXPECT_TRUE(measure(found.surface).closed);
}

TEST(RestoreTest, HandlesDegeneratePoints) {
  for (const unsigned bits : {0u, 24u}) {
    RestoreOptions options;
    options.quantise_bits = bits;
    EXPECT_TRUE(restore_surface({}, options).surface.faces.empty());
    const std::vector<Point3> equal(5, Point3{1, 2, 3});
    EXPECT_TRUE(restore_surface(equal, options).surface.faces.empty());
    for (const PointSet3 kind : {PointSet3::line, PointSet3::plane}) {
      const auto points = make_points3<double>(kind, 30, 2);
      const Surface surface = restore_surface(points, options).surface;
      // Rounding moves points off their plane.
      if (bits == 0) {
        EXPECT_TRUE(surface.faces.empty());
      }
      measure(surface);
    }
    for (const PointSet3 kind : {PointSet3::grid, PointSet3::few_bits, PointSet3::off_plane})
      measure(restore_surface(make_points3<double>(kind, 60, 2), options).surface);
  }
}

TEST(RestoreTest, HandlesExtremeCoordinates) {
  for (const PointSet3 kind : {PointSet3::huge, PointSet3::tiny}) {
    const auto points = make_points3<double>(kind, 100, 2);
    for (const unsigned bits : {0u, 24u}) {
      RestoreOptions options;
      options.quantise_bits = bits;
      EXPECT_FALSE(restore_surface(points, options).surface.faces.empty());
    }
  }
  std::vector<Point3> ends = {{-1.7e308, 0, 0}, {1.7e308, 0, 0}, {0, 1.7e308, 0}, {0, 0, -1.7e308}};
  RestoreOptions options;
  options.quantise_bits = 30;
  EXPECT_EQ(restore_surface(ends, options).surface.faces.size(), 4u);
}

std::string message(std::span<const Point3> points, const RestoreOptions& options) {
  try {
    restore_surface(points, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(RestoreTest, ErrorsNameBadInput) {
  std::vector<Point3> points = sphere(10);
  const auto expect_named = [&](const char* what, auto&& change) {
    RestoreOptions options;
    change(options);
    EXPECT_NE(message(points, options).find(what), std::string::npos) << message(points, options);
  };
  expect_named("quantise_bits", [](auto& options) { options.quantise_bits = 31; });
  expect_named("edge lengths", [](auto& options) { options.shape.edge_factor = 0; });
  points[7][1] = std::numeric_limits<double>::quiet_NaN();
  expect_named("point 7", [](auto&) {});
}

}  // namespace
}  // namespace terrace::tri
