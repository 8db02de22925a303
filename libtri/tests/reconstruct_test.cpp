// SPDX-License-Identifier: GPL-3.0-or-later
#include "terrace/tri/reconstruct.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "points3.hpp"

namespace terrace::tri {
namespace {

constexpr SurfaceMethod kSurfaceMethods[] = {SurfaceMethod::kShape, SurfaceMethod::kAdvancingFront,
                                             SurfaceMethod::kAlphaWrap};

/// On a Fibonacci spiral, in random order.
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

SurfaceOptions with(SurfaceMethod method) {
  SurfaceOptions options;
  options.method = method;
  return options;
}

TEST(ReconstructTest, EveryMethodGivesASphere) {
  const std::vector<Point3> points = sphere(1500);
  for (const SurfaceMethod method : kSurfaceMethods) {
    SCOPED_TRACE("method " + std::to_string(static_cast<int>(method)));
    const ReconstructedSurface found = reconstruct_surface(points, with(method));
    const SurfaceMeasures measured = measure(found.surface);
    EXPECT_TRUE(measured.closed);
    EXPECT_EQ(measured.components, 1u);
    EXPECT_EQ(measured.euler_characteristic, 2);
    EXPECT_EQ(measured.non_manifold_edges, 0u);
    EXPECT_EQ(measured.vertices, found.surface.points.size());
    const double ratio = measured.volume / (4 * std::numbers::pi / 3);
    if (method == SurfaceMethod::kAlphaWrap) {
      EXPECT_TRUE(found.input.empty());
      EXPECT_GT(ratio, 1.0);
      EXPECT_LT(ratio, 1.25);
    } else {
      EXPECT_NEAR(ratio, 1.0, 0.02);
      ASSERT_EQ(found.input.size(), points.size());
      for (std::size_t i = 0; i < points.size(); ++i)
        ASSERT_EQ(found.surface.points[i], points[found.input[i]]);
    }
    const ReconstructedSurface again = reconstruct_surface(points, with(method));
    if (method == SurfaceMethod::kAdvancingFront) {
      EXPECT_EQ(again.surface.faces.size(), found.surface.faces.size());
    } else {
      EXPECT_TRUE(again.surface.faces == found.surface.faces);
    }
    EXPECT_TRUE(again.surface.points == found.surface.points);
  }
}

TEST(ReconstructTest, RoundedPointsGiveTheSameSurface) {
  const std::vector<Point3> points = sphere(1500);
  const SurfaceMeasures exact = measure(reconstruct_surface(points).surface);
  for (const unsigned bits : {16u, 24u, 30u}) {
    SurfaceOptions options;
    options.quantise_bits = bits;
    const ReconstructedSurface found = reconstruct_surface(points, options);
    for (std::size_t i = 0; i < found.input.size(); ++i)
      ASSERT_EQ(found.surface.points[i], points[found.input[i]]);
    const SurfaceMeasures measured = measure(found.surface);
    EXPECT_EQ(measured.faces, exact.faces);
    EXPECT_NEAR(measured.volume, exact.volume, 1e-3);
    EXPECT_NEAR(measured.area, exact.area, 1e-2);
  }
}

TEST(ReconstructTest, CoarseRoundingJoinsPoints) {
  SurfaceOptions options;
  options.quantise_bits = 2;
  const ReconstructedSurface found = reconstruct_surface(sphere(1500), options);
  EXPECT_LE(found.surface.points.size(), 64u);
  EXPECT_TRUE(measure(found.surface).closed);
}

TEST(ReconstructTest, DegeneratePoints) {
  for (const SurfaceMethod method : kSurfaceMethods) {
    for (const unsigned bits : {0u, 24u}) {
      SurfaceOptions options = with(method);
      options.quantise_bits = bits;
      SCOPED_TRACE("method " + std::to_string(static_cast<int>(method)));
      EXPECT_TRUE(reconstruct_surface({}, options).surface.faces.empty());
      const std::vector<Point3> equal(5, Point3{1, 2, 3});
      EXPECT_TRUE(reconstruct_surface(equal, options).surface.faces.empty());
      for (const PointSet3 kind : {PointSet3::kLine, PointSet3::kPlane}) {
        const auto points = make_points3<double>(kind, 30, 2);
        const Surface surface = reconstruct_surface(points, options).surface;
        if (method == SurfaceMethod::kAdvancingFront ||
            (method == SurfaceMethod::kShape && bits == 0)) {
          EXPECT_TRUE(surface.faces.empty());
        }
        measure(surface);
      }
      for (const PointSet3 kind : {PointSet3::kGrid, PointSet3::kFewBits, PointSet3::kOffPlane})
        measure(reconstruct_surface(make_points3<double>(kind, 60, 2), options).surface);
    }
  }
}

TEST(ReconstructTest, ExtremeCoordinates) {
  for (const PointSet3 kind : {PointSet3::kHuge, PointSet3::kTiny}) {
    const auto points = make_points3<double>(kind, 100, 2);
    for (const unsigned bits : {0u, 24u}) {
      SurfaceOptions options;
      options.quantise_bits = bits;
      EXPECT_FALSE(reconstruct_surface(points, options).surface.faces.empty());
    }
    for (const auto method : {SurfaceMethod::kAdvancingFront, SurfaceMethod::kAlphaWrap})
      EXPECT_THROW(reconstruct_surface(points, with(method)), std::invalid_argument);
  }
  std::vector<Point3> ends = {{-1.7e308, 0, 0}, {1.7e308, 0, 0}, {0, 1.7e308, 0}, {0, 0, -1.7e308}};
  SurfaceOptions options;
  options.quantise_bits = 30;
  EXPECT_EQ(reconstruct_surface(ends, options).surface.faces.size(), 4u);
}

std::string message(std::span<const Point3> points, const SurfaceOptions& options) {
  try {
    reconstruct_surface(points, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(ReconstructTest, BadInputIsNamed) {
  std::vector<Point3> points = sphere(10);
  const auto names = [&](const char* what, auto&& change) {
    SurfaceOptions options;
    change(options);
    EXPECT_NE(message(points, options).find(what), std::string::npos) << message(points, options);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  names("quantise_bits", [](auto& options) { options.quantise_bits = 31; });
  names("alpha", [&](auto& options) { options.alpha = nan; });
  names("offset", [](auto& options) { options.offset = -1; });
  names("beta", [](auto& options) { options.beta = 2; });
  names("radius_ratio_bound", [](auto& options) { options.radius_ratio_bound = 0; });
  names("edge lengths", [](auto& options) { options.shape.edge_factor = 0; });
  points[7][1] = nan;
  for (const SurfaceMethod method : kSurfaceMethods)
    names("point 7", [&](auto& options) { options.method = method; });
}

}  // namespace
}  // namespace terrace::tri
