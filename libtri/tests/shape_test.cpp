// SPDX-License-Identifier: Apache-2.0
// Synthetic shapes of known volume, and options.
#include "terrace/tri/shape.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "points3.hpp"
#include "scan_file.hpp"

namespace terrace::tri {
namespace {

constexpr double kPi = std::numbers::pi;
using Points = std::vector<Point3>;

struct Noise {
  std::mt19937_64 random;
  double size;
  double operator()() { return (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5) * 2 * size; }
};

/// Rings about the z axis through the points of a profile, about `step` apart.
void add_revolved(Points& points, const std::vector<std::array<double, 2>>& profile, double step,
                  Noise& noise) {
  for (const auto& [radius, z] : profile) {
    const auto count = static_cast<int>(std::max(1.0, 2 * kPi * radius / step));
    const double start = noise() * 100;
    for (int i = 0; i < count; ++i) {
      const double angle = start + 2 * kPi * i / count;
      points.push_back(
          {radius * std::cos(angle) + noise(), radius * std::sin(angle) + noise(), z + noise()});
    }
  }
}

Points sphere(double radius, Point3 centre, double step, Noise& noise) {
  std::vector<std::array<double, 2>> profile;
  const auto rings = static_cast<int>(kPi * radius / step);
  for (int i = 0; i <= rings; ++i) {
    const double angle = kPi * i / rings;
    profile.push_back({radius * std::sin(angle), radius * std::cos(angle)});
  }
  Points points;
  add_revolved(points, profile, step, noise);
  for (auto& p : points)
    for (std::size_t k = 0; k < 3; ++k) p[k] += centre[k];
  return points;
}

void add_line(std::vector<std::array<double, 2>>& profile, std::array<double, 2> from,
              std::array<double, 2> to, double step) {
  const double length = std::hypot(to[0] - from[0], to[1] - from[1]);
  const auto count = static_cast<int>(std::ceil(length / step));
  for (int i = 0; i < count; ++i)
    profile.push_back(
        {from[0] + (to[0] - from[0]) * i / count, from[1] + (to[1] - from[1]) * i / count});
}

/// Measures the restored surface, which must be the same from doubles and from 24-bit integers up
/// to rounding.
SurfaceMeasures restored(const Points& points, const ShapeOptions& options = {}) {
  Delaunay3<double> triangulation;
  triangulation.build(points);
  Shape3<double> shape(options);
  shape.restore(triangulation);
  const ShapeSurface surface = shape.surface(triangulation);
  for (std::size_t i = 0; i < surface.vertices.size(); ++i)
    EXPECT_EQ(surface.surface.points[i], triangulation.point(surface.vertices[i]));
  const SurfaceMeasures measured = measure(surface.surface);
  EXPECT_TRUE(measured.closed);
  EXPECT_NEAR(shape.volume(triangulation), measured.volume, 1e-9 * measured.volume);

  double step = 0.0;
  Delaunay3<std::int32_t> integer_mesh;
  integer_mesh.build(quantised(points, step));
  Shape3<std::int32_t> other(options);
  other.restore(integer_mesh);
  const SurfaceMeasures repeated = measure(other.surface(integer_mesh).surface);
  EXPECT_TRUE(repeated.closed);
  EXPECT_EQ(repeated.euler_characteristic, measured.euler_characteristic);
  EXPECT_NEAR(repeated.volume * step * step * step, measured.volume, 1e-3 * measured.volume);
  EXPECT_NEAR(repeated.area * step * step, measured.area, 1e-3 * measured.area);
  return measured;
}

TEST(ShapeTest, RestoresATorusWithNoise) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Noise noise{std::mt19937_64(seed), 0.002};
    std::vector<std::array<double, 2>> profile;
    for (int i = 0; i < 50; ++i) {
      const double angle = 2 * kPi * i / 50;
      profile.push_back({1 + 0.4 * std::cos(angle), 0.4 * std::sin(angle)});
    }
    Points points;
    add_revolved(points, profile, 0.05, noise);
    const SurfaceMeasures measured = restored(points);
    EXPECT_EQ(measured.components, 1u);
    EXPECT_EQ(measured.euler_characteristic, 0);
    EXPECT_EQ(measured.non_manifold_edges, 0u);
    EXPECT_NEAR(measured.volume / (2 * kPi * kPi * 0.16), 1.0, 0.02);
    EXPECT_NEAR(measured.area / (4 * kPi * kPi * 0.4), 1.0, 0.03);
  }
}

TEST(ShapeTest, RestoresTwoSpheres) {
  Noise noise{std::mt19937_64(5), 0.001};
  Points points = sphere(1.0, {0, 0, 0}, 0.08, noise);
  const Points other = sphere(0.5, {2.9, 0.2, 0.1}, 0.05, noise);
  points.insert(points.end(), other.begin(), other.end());
  const SurfaceMeasures measured = restored(points);
  EXPECT_EQ(measured.components, 2u);
  EXPECT_EQ(measured.euler_characteristic, 4);
  EXPECT_NEAR(measured.volume / (4 * kPi / 3 * (1 + 0.125)), 1.0, 0.02);
  EXPECT_NEAR(measured.area / (4 * kPi * (1 + 0.25)), 1.0, 0.02);
}

TEST(ShapeTest, RestoresACup) {
  // The height is 2 and the outer radius 1. The cavity goes down to 0.4 and widens from radius 0.5
  // to 0.8.
  Noise noise{std::mt19937_64(6), 0.001};
  std::vector<std::array<double, 2>> profile;
  const double step = 0.05;
  add_line(profile, {0, 0}, {1, 0}, step);
  add_line(profile, {1, 0}, {1, 2}, step);
  add_line(profile, {1, 2}, {0.8, 2}, step);
  add_line(profile, {0.8, 2}, {0.5, 0.4}, step);
  add_line(profile, {0.5, 0.4}, {0, 0.4}, step);
  profile.push_back({0, 0.4});
  Points points;
  add_revolved(points, profile, step, noise);
  const SurfaceMeasures measured = restored(points);
  EXPECT_EQ(measured.components, 1u);
  EXPECT_EQ(measured.euler_characteristic, 2);
  const double cavity = kPi * 1.6 / 3 * (0.64 + 0.4 + 0.25);
  EXPECT_NEAR(measured.volume / (kPi * 2 - cavity), 1.0, 0.02);
}

TEST(ShapeTest, RestoresASphereByEdgeLength) {
  Noise noise{std::mt19937_64(7), 0.001};
  ShapeOptions options;
  options.rule = ShapeRule::flood;
  options.criterion = ShapeCriterion::edge_length;
  options.edge_factor = 1.0;
  const SurfaceMeasures measured = restored(sphere(1.0, {0, 0, 0}, 0.1, noise), options);
  EXPECT_EQ(measured.components, 1u);
  EXPECT_NEAR(measured.volume / (4 * kPi / 3), 1.0, 0.05);
}

TEST(ShapeTest, PublishedRuleLeavesMore) {
  Noise noise{std::mt19937_64(8), 0.002};
  Points points = sphere(1.0, {0, 0, 0}, 0.1, noise);
  const Points other = sphere(0.5, {2.2, 0.2, 0.1}, 0.06, noise);
  points.insert(points.end(), other.begin(), other.end());
  Delaunay3<double> triangulation;
  triangulation.build(points);
  ShapeOptions options;
  options.rule = ShapeRule::flood;
  options.keep_vertices = false;
  Shape3<double> flood(options);
  flood.restore(triangulation);
  options.rule = ShapeRule::published;
  Shape3<double> published(options);
  published.restore(triangulation);
  // The flood must remove every tetrahedron that the published rule removes.
  for (const TetrahedronId t : triangulation.all_tetrahedra()) {
    if (flood.kept(t)) {
      EXPECT_TRUE(published.kept(t));
    }
  }
  EXPECT_GT(published.kept_count(), flood.kept_count());
}

TEST(ShapeTest, KeepsAGridWhole) {
  // No facet's smallest sphere contains a grid point in its interior.
  const auto points = make_points3<std::int32_t>(PointSet3::grid, 512, 0);
  Delaunay3<std::int32_t> triangulation;
  triangulation.build(points);
  ShapeOptions options;
  options.rule = ShapeRule::flood;
  Shape3<std::int32_t> shape(options);
  shape.restore(triangulation);
  const SurfaceMeasures measured = measure(shape.surface(triangulation).surface);
  EXPECT_EQ(shape.kept_count(), triangulation.tetrahedron_count());
  EXPECT_EQ(measured.volume, 49.0 * 49.0 * 49.0);
  EXPECT_EQ(measured.euler_characteristic, 2);
}

TEST(ShapeTest, IsEmptyWithoutTetrahedra) {
  for (const PointSet3 kind : {PointSet3::line, PointSet3::plane}) {
    for (const std::size_t count : {0u, 1u, 2u, 3u, 50u}) {
      Delaunay3<double> triangulation;
      triangulation.build(make_points3<double>(kind, count, 1));
      Shape3<double> shape;
      shape.restore(triangulation);
      EXPECT_EQ(shape.kept_count(), 0u);
      EXPECT_TRUE(shape.lost_vertices().empty());
      EXPECT_TRUE(shape.surface(triangulation).surface.faces.empty());
      EXPECT_EQ(shape.volume(triangulation), 0.0);
    }
  }
  EXPECT_FALSE(Shape3<double>().kept(TetrahedronId{3}));
  EXPECT_FALSE(Shape3<double>().kept(kNoTetrahedron));
}

TEST(ShapeTest, ChecksTheEdgeFactor) {
  for (const double factor : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity()}) {
    ShapeOptions options;
    options.edge_factor = factor;
    EXPECT_THROW(Shape3<double>{options}, std::invalid_argument) << factor;
  }
}

}  // namespace
}  // namespace terrace::tri
