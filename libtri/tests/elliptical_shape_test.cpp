// SPDX-License-Identifier: Apache-2.0
// The shape in an elliptical metric must equal the shape of the mapped points.
#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "delaunay3/access.hpp"
#include "metrics3.hpp"
#include "multiresolution_hierarchy.hpp"
#include "points3.hpp"
#include "shape/gabriel.hpp"
#include "terrace/tri/multiresolution.hpp"
#include "terrace/tri/shape.hpp"

namespace terrace::tri::test {
namespace {

/// Points distributed uniformly on the unit sphere, along a spiral, then stretched.
std::vector<Space> ellipsoid(std::size_t count, const Space& radii) {
  std::vector<Space> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double angle = static_cast<double>(i) * 2.399963229728653;
    const double r = std::sqrt(1 - z * z);
    points.push_back(
        {radii[0] * r * std::cos(angle), radii[1] * r * std::sin(angle), radii[2] * z});
  }
  return points;
}

std::vector<ShapeOptions> all_options() {
  std::vector<ShapeOptions> result{{}};
  for (const auto criterion : {ShapeCriterion::gabriel, ShapeCriterion::edge_length}) {
    for (const auto rule : {ShapeRule::flood, ShapeRule::published}) {
      for (const bool keep : {true, false}) {
        result.push_back({rule, criterion, 0.7, keep});
      }
    }
  }
  return result;
}

/// Integer maps that keep the lexicographic order map small integer points without rounding.
TEST(EllipticalShape, IntegerPointsAndMapsGiveTheShapeOfMappedPoints) {
  for (const LinearMap3& m :
       {LinearMap3{4, 0, 0, 0, 1, 0, 0, 0, 0.5}, LinearMap3{1, 0, 0, 3, 1, 0, -2, 5, 1}}) {
    for (const PointSet3 kind : {PointSet3::five_bits, PointSet3::grid, PointSet3::sphere,
                                 PointSet3::slab, PointSet3::clusters, PointSet3::plane}) {
      const auto points = make_points3<double>(kind, 250, 4);
      std::vector<Space> mapped;
      for (const Space& p : points)
        mapped.push_back(
            {m[0] * p[0], m[3] * p[0] + m[4] * p[1], m[6] * p[0] + m[7] * p[1] + m[8] * p[2]});
      Elliptical3 elliptical(m);
      Delaunay3<double> plain;
      elliptical.build(points);
      const auto vertices = plain.build(mapped);
      std::vector<Space> original(plain.vertex_slots());
      for (std::size_t i = 0; i < points.size(); ++i) original[slot(vertices[i])] = points[i];
      for (const ShapeOptions& options : all_options()) {
        SCOPED_TRACE(name(kind) + " map " + std::to_string(m[3]) + " criterion " +
                     std::to_string(static_cast<int>(options.criterion)) + " rule " +
                     std::to_string(static_cast<int>(options.rule)));
        Shape3<double, EllipticalMetric3> shape(options);
        Shape3<double> other(options);
        shape.restore(elliptical);
        other.restore(plain);
        ASSERT_EQ(shape.kept_count(), other.kept_count());
        ASSERT_EQ(shape.rescued_count(), other.rescued_count());
        const auto corners = [](const auto& at, const auto& triangulation, TetrahedronId t) {
          Corners3 result;
          for (std::size_t i = 0; i < 4; ++i) result[i] = at(triangulation.vertices(t)[i]);
          std::sort(result.begin(), result.end());
          return result;
        };
        std::vector<Corners3> ours, plain_corners;
        for (const TetrahedronId t : shape.kept_tetrahedra())
          ours.push_back(corners([&](VertexId v) { return elliptical.point(v); }, elliptical, t));
        for (const TetrahedronId t : other.kept_tetrahedra())
          plain_corners.push_back(corners([&](VertexId v) { return original[slot(v)]; }, plain, t));
        std::sort(ours.begin(), ours.end());
        std::sort(plain_corners.begin(), plain_corners.end());
        ASSERT_TRUE(ours == plain_corners);
      }
    }
  }
}

TEST(EllipticalShape, FollowsTheModel) {
  const LinearMap3 map = ellipsoid_map({3, 1, 2}, rotations()[3]);
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    MemorySource source = make_hierarchy(ellipsoid(400, {30, 10, 20}), 2, 8.0, random);
    MultiresolutionModel<Elliptical3> model(source, {}, {}, Elliptical3(map));
    Shape3<double, EllipticalMetric3> shape;
    shape.restore(model.triangulation());
    for (int step = 0; step < 10; ++step) {
      const Box3 box{{-40, -40, -40},
                     {unit(random) * 60 - 30, unit(random) * 20 - 10, unit(random) * 40 - 20}};
      const auto& delta = step % 2 == 0
                              ? model.refine(box, static_cast<unsigned>(below(random, 2)))
                              : model.coarsen(box, 1 + static_cast<unsigned>(below(random, 2)));
      shape.update(model.triangulation(), delta.changes);
      Shape3<double, EllipticalMetric3> repeated;
      repeated.restore(model.triangulation());
      ASSERT_EQ(shape.kept_tetrahedra(), repeated.kept_tetrahedra());
    }
  }
}

TEST(EllipticalShape, RestoresAnEllipsoidOfStretchedSamples) {
  const Space radii{1, 1, 40};
  const auto points = ellipsoid(2000, radii);
  RestoreOptions options;
  options.metric = ellipsoid_map(radii);
  const RestoredSurface surface = restore_surface(points, options);
  const SurfaceMeasures measures = measure(surface.surface);
  EXPECT_TRUE(measures.closed);
  EXPECT_EQ(measures.vertices, 2000u);
  EXPECT_EQ(measures.faces, 3996u);
  EXPECT_EQ(measures.components, 1u);
  EXPECT_EQ(measures.euler_characteristic, 2);
  EXPECT_NEAR(measures.volume, 4.0 / 3 * 3.141592653589793 * 40, 1.5);
  // Edge lengths with a factor of 1, which restores uniform samples (see ShapeOptions).
  options.shape = {ShapeRule::flood, ShapeCriterion::edge_length, 1.0, true};
  EXPECT_EQ(measure(restore_surface(points, options).surface).faces, 3996u);

  options.quantise_bits = 20;
  EXPECT_THROW(static_cast<void>(restore_surface(points, options)), std::invalid_argument);
  EXPECT_THROW((options.metric = LinearMap3{1, 0, 0, 0, 1, 0, 1, 1, 0}), std::invalid_argument);
}

TEST(EllipticalShape, StretchedTorusKeepsItsHoleOnlyInTheMetric) {
  constexpr double kTurn = 6.283185307179586;
  std::vector<Space> points;
  for (int i = 0; i < 3000; ++i) {
    const double u = kTurn * std::fmod(i * 0.6180339887498949, 1.0), v = kTurn * i / 3000;
    points.push_back({(1 + 0.4 * std::cos(v)) * std::cos(u),
                      30 * (1 + 0.4 * std::cos(v)) * std::sin(u), 0.4 * std::sin(v)});
  }
  RestoreOptions options;
  const double euclidean = measure(restore_surface(points).surface).volume;
  options.metric = ellipsoid_map({1, 30, 1});
  const SurfaceMeasures measures = measure(restore_surface(points, options).surface);
  const double expected = kTurn * kTurn / 2 * 0.16 * 30;
  EXPECT_TRUE(measures.closed);
  EXPECT_EQ(measures.components, 1u);
  EXPECT_EQ(measures.euler_characteristic, 0);
  EXPECT_NEAR(measures.volume, expected, 0.02 * expected);
  EXPECT_GT(std::abs(euclidean - expected), 0.1 * expected);
}

TEST(EllipticalShape, SmallestEllipsoidFilterAgreesWithTheExactTest) {
  using spatial::EllipticalKernel;
  std::mt19937_64 random(9);
  int filtered = 0;
  for (int round = 0; round < 4000; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    const LinearMap3 map =
        ellipsoid_map({std::ldexp(1.0, round % 20), 1, 3}, rotations()[random() % 5]);
    const spatial::QuadraticForm form(map);
    const EllipticalKernel::Scope scope(form);
    std::array<Space, 4> p;
    for (Space& point : p)
      for (double& c : point) c = static_cast<double>(random() % 12) * (round % 2 == 0 ? 1 : 0.1);
    if (EllipticalKernel::collinear(p[0], p[1], p[2])) continue;
    const bool exact = EllipticalKernel::in_smallest_sphere(p[0], p[1], p[2], p[3]);
    ASSERT_EQ(shape::in_smallest_ellipsoid(p[0], p[1], p[2], p[3]), exact);
    const int side = shape::filter_smallest_sphere(
        EllipticalKernel::mapped(p[1], p[0]), EllipticalKernel::mapped(p[2], p[0]),
        EllipticalKernel::mapped(p[3], p[0]), form.spread());
    filtered += side != 0;
  }
  EXPECT_GT(filtered, 2000);
}

}  // namespace
}  // namespace terrace::tri::test
