// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/view.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "multiresolution_hierarchy.hpp"
#include "view/columns.hpp"

namespace terrace::tri::test {
namespace {

bool sees(const Camera& camera, const Point3& p) {
  for (const Plane& plane : camera.planes) {
    double s = plane.offset;
    for (std::size_t k = 0; k < 3; ++k) s += plane.normal[k] * p[k];
    if (!(s >= 0.0)) return false;
  }
  return true;
}

using Matrix = std::array<double, 16>;

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix c{};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      for (std::size_t k = 0; k < 4; ++k) c[4 * i + j] += a[4 * i + k] * b[4 * k + j];
    }
  }
  return c;
}

// Looks along -z of a frame rotated about z and then tilted about x.
Matrix view_matrix(const Point3& eye, double turn, double tilt) {
  const double c = std::cos(turn), s = std::sin(turn), d = std::cos(tilt), t = std::sin(tilt);
  const Matrix move{1, 0, 0, -eye[0], 0, 1, 0, -eye[1], 0, 0, 1, -eye[2], 0, 0, 0, 1};
  const Matrix about_z{c, s, 0, 0, -s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  const Matrix about_x{1, 0, 0, 0, 0, d, t, 0, 0, -t, d, 0, 0, 0, 0, 1};
  return product(about_x, product(about_z, move));
}

Pose pose_of(const Point3& eye, double turn, double tilt) {
  const double c = std::cos(turn), s = std::sin(turn), d = std::cos(tilt), t = std::sin(tilt);
  return {eye, {-s * t, c * t, -d}, {-s * d, c * d, t}};
}

// A matrix and the parameters from which it is made must give the same camera. A point is visible
// if the matrix maps it into the picture, and a step across the view must have as many pixels as
// the matrix maps it to.
TEST(Camera, MatrixAndPoseAgree) {
  std::mt19937_64 random(1);
  int visible = 0;
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(i);
    const Point3 eye{1e6 * unit(random), 1e6 * unit(random), 1000.0 * unit(random)};
    const double turn = 6.0 * unit(random), tilt = 3.0 * unit(random);
    const double fov = 10.0 + 100.0 * unit(random), aspect = 0.5 + 2.0 * unit(random);
    const double height = 1000.0 * (1.0 + unit(random));
    const double f = 1.0 / std::tan(fov * std::acos(-1.0) / 360.0);
    const bool perspective = i % 3 != 0;
    const double extent = 500.0 * (0.1 + unit(random));
    // Depth in one of the usual conventions.
    const Matrix projection =
        perspective
            ? (i % 2 ? Matrix{f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, -1.002, -0.2002, 0, 0, -1, 0}
                     : Matrix{f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, 0, 0.1, 0, 0, -1, 0})
            : Matrix{
                  2 / (extent * aspect), 0, 0, 0, 0, 2 / extent, 0, 0, 0, 0, -0.001, 0, 0, 0, 0, 1};
    const Matrix matrix = product(projection, view_matrix(eye, turn, tilt));
    const Pose pose = pose_of(eye, turn, tilt);
    const Camera from_pose = perspective ? perspective_camera(pose, fov, aspect, height)
                                         : orthographic_camera(pose, extent, aspect, height);
    const Camera from_matrix = matrix_camera(matrix, height);
    ASSERT_EQ(from_pose.perspective, from_matrix.perspective);
    ASSERT_NEAR(from_matrix.pixels / from_pose.pixels, 1.0, 1e-9);
    if (!perspective) {
      ASSERT_NEAR(from_matrix.height / from_pose.height, 1.0, 1e-9);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_NEAR(from_pose.position[k], from_matrix.position[k], 1e-3);
      ASSERT_NEAR(std::abs(from_pose.direction[k]), std::abs(from_matrix.direction[k]), 1e-9);
    }
    for (int j = 0; j < 300; ++j) {
      Point3 p = eye;
      for (std::size_t k = 0; k < 3; ++k) p[k] += 800.0 * (unit(random) - 0.5);
      std::array<double, 4> clip{};
      for (std::size_t r = 0; r < 4; ++r) {
        clip[r] = matrix[4 * r + 3];
        for (std::size_t k = 0; k < 3; ++k) clip[r] += matrix[4 * r + k] * p[k];
      }
      const double edge = std::min(clip[3] - std::abs(clip[0]), clip[3] - std::abs(clip[1]));
      if (std::abs(edge) < 1e-6) continue;
      const bool inside = edge > 0.0;
      visible += inside;
      ASSERT_EQ(sees(from_pose, p), inside);
      ASSERT_EQ(sees(from_matrix, p), inside);
    }
  }
  EXPECT_GT(visible, 500);
}

// An off-centre projection must be as sharp as a centred one.
TEST(Camera, HandlesShearedProjections) {
  Matrix projection{1, 0, 0.4, 0, 0, 1.5, -0.7, 0, 0, 0, -1, -1, 0, 0, -1, 0};
  const Camera camera = matrix_camera(projection, 900.0);
  EXPECT_NEAR(camera.pixels, 1.5 * 450.0, 1e-9);
  EXPECT_TRUE(camera.perspective);
  EXPECT_NEAR(camera.direction[2], -1.0, 1e-12);
}

TEST(Camera, PixelsMatchTheDefinition) {
  const Camera camera = perspective_camera({}, 90.0, 1.0, 1000.0);
  EXPECT_NEAR(camera.pixels, 500.0, 1e-9);
  EXPECT_NEAR(orthographic_camera({}, 250.0, 1.0, 1000.0).pixels, 4.0, 1e-12);
}

TEST(Camera, RejectsInvalidParameters) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, nan, infinity}) {
    EXPECT_THROW(perspective_camera({}, bad, 1.0, 100.0), std::invalid_argument);
    EXPECT_THROW(perspective_camera({}, 60.0, bad, 100.0), std::invalid_argument);
    EXPECT_THROW(perspective_camera({}, 60.0, 1.0, bad), std::invalid_argument);
    EXPECT_THROW(orthographic_camera({}, bad, 1.0, 100.0), std::invalid_argument);
    EXPECT_THROW(orthographic_camera({}, 1.0, bad, 100.0), std::invalid_argument);
    EXPECT_THROW(orthographic_camera({}, 1.0, 1.0, bad), std::invalid_argument);
    EXPECT_THROW(matrix_camera({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, bad),
                 std::invalid_argument);
  }
  EXPECT_THROW(perspective_camera({}, 180.0, 1.0, 100.0), std::invalid_argument);
  Pose pose;
  pose.position[1] = nan;
  EXPECT_THROW(perspective_camera(pose, 60.0, 1.0, 100.0), std::invalid_argument);
  pose = {};
  pose.up = pose.direction;
  EXPECT_THROW(orthographic_camera(pose, 60.0, 1.0, 100.0), std::invalid_argument);
  pose = {};
  pose.direction = {};
  EXPECT_THROW(orthographic_camera(pose, 60.0, 1.0, 100.0), std::invalid_argument);
  EXPECT_THROW(matrix_camera({}, 100.0), std::invalid_argument);
  EXPECT_THROW(matrix_camera({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1}, 100.0),
               std::invalid_argument);
  EXPECT_THROW(matrix_camera({nan, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, 100.0),
               std::invalid_argument);
}

ViewDemand measured(const View& view, const ViewOptions& options,
                    const std::vector<ClusterRecord>& records, const NormalCone* cone = nullptr) {
  ViewColumns columns(options.silhouette < 1.0);
  columns.resize(records.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    columns.set(i, records[i], 0);
    if (cone) columns.set_cone(i, *cone);
  }
  ViewDemand demand;
  demand.resize(records.size());
  measure(view, options, columns, 0, records.size(), demand);
  return demand;
}

// A box inside another must never have a greater demand, including rounding.
TEST(ViewMeasure, DemandNeverGrowsInward) {
  std::mt19937_64 random(2);
  int in_view = 0;
  for (int i = 0; i < 3000; ++i) {
    const double scale = std::exp2(40.0 * unit(random) - 20.0);
    const auto place = [&] { return scale * (unit(random) - 0.5); };
    Box3 outer, inner;
    for (std::size_t k = 0; k < 3; ++k) {
      const double a = place(), b = place();
      outer.min[k] = std::min(a, b);
      outer.max[k] = std::max(a, b);
      inner.min[k] = below(random, 2) ? outer.min[k] : a + unit(random) * (b - a);
      inner.min[k] = std::clamp(inner.min[k], outer.min[k], outer.max[k]);
      inner.max[k] = std::clamp(inner.min[k] + scale * unit(random), inner.min[k], outer.max[k]);
    }
    Pose pose{
        {place(), place(), place()}, {place(), place(), place()}, {place(), place(), place()}};
    View view;
    view.camera = below(random, 3)
                      ? perspective_camera(pose, 1.0 + 150.0 * unit(random), 1.5, 999.0)
                      : orthographic_camera(pose, scale * unit(random), 1.5, 999.0);
    view.ground_error = scale;
    view.regions.push_back({{{0, 0, 0}, {scale, scale, scale}}, 0.1 * scale});
    const double error = scale * unit(random);
    const ViewDemand demand = measured(view, {}, {{outer, error, 1}, {inner, error, 1}});
    ASSERT_LE(demand.want[1], demand.want[0]);
    ASSERT_LE(demand.keep[1], demand.keep[0]);
    ASSERT_LE(demand.want[0], demand.keep[0]);
    ASSERT_LE(demand.want[1], demand.keep[1]);
    ASSERT_GE(demand.distance[1], demand.distance[0]);
    in_view += demand.want[1] > error / scale;
  }
  EXPECT_GT(in_view, 500);
}

// Level ground seen from above shows no outline. Seen from the side, or if the cone is wide, it
// may. Random normals and lines of sight check that an outline is never missed.
TEST(ViewMeasure, OutlinesAreNeverMissed) {
  ViewOptions options;
  options.silhouette = 0.25;
  View view;
  view.camera = perspective_camera({{0, 0, 100}, {0, 0, -1}, {0, 1, 0}}, 90.0, 1.0, 1000.0);
  const ClusterRecord below_eye{{{-5, -5, 0}, {5, 5, 1}}, 1.0, 1};
  const NormalCone level{{0, 0, 1}, 10.0}, steep{{0, 0, 1}, 89.0}, side{{1, 0, 0}, 10.0};
  const double plain = measured(view, {}, {below_eye}).want[0];
  ASSERT_GT(plain, 0.0);
  EXPECT_EQ(measured(view, options, {below_eye}, &level).want[0], plain);
  EXPECT_EQ(measured(view, options, {below_eye}, &steep).want[0], 4.0 * plain);
  EXPECT_EQ(measured(view, options, {below_eye}, &side).want[0], 4.0 * plain);
  const NormalCone unknown{{0, 0, 1}, std::nan("")};
  EXPECT_EQ(measured(view, options, {below_eye}, &unknown).want[0], 4.0 * plain);

  std::mt19937_64 random(3);
  const auto direction = [&] {
    for (;;) {
      const Point3 v{unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5};
      const double length = std::hypot(v[0], v[1], v[2]);
      if (length > 0.1 && length < 0.5) return Point3{v[0] / length, v[1] / length, v[2] / length};
    }
  };
  int outlines = 0, plains = 0;
  for (int i = 0; i < 300; ++i) {
    const Point3 forward = direction(), up = direction(), eye{unit(random), unit(random), 0.5};
    View v;
    v.camera = i % 3 ? perspective_camera({eye, forward, up}, 60.0, 1.0, 1000.0)
                     : orthographic_camera({eye, forward, up}, 2.0, 1.0, 1000.0);
    ClusterRecord record{{eye, eye}, 1.0, 1};
    for (std::size_t k = 0; k < 3; ++k) {
      record.box.min[k] += 4.0 * forward[k] - unit(random);
      record.box.max[k] += 4.0 * forward[k] + unit(random);
    }
    const NormalCone cone{direction(), 60.0 * unit(random)};
    const double without_cone = measured(v, {}, {record}).want[0];
    const double with_cone = measured(v, options, {record}, &cone).want[0];
    bool outline = false;
    for (int j = 0; j < 500 && !outline; ++j) {
      Point3 sight = v.camera->direction;
      if (v.camera->perspective) {
        for (std::size_t k = 0; k < 3; ++k) {
          sight[k] =
              record.box.min[k] + unit(random) * (record.box.max[k] - record.box.min[k]) - eye[k];
        }
      }
      const double length = std::hypot(sight[0], sight[1], sight[2]);
      double along = 0.0;
      for (std::size_t k = 0; k < 3; ++k) along += cone.axis[k] * sight[k] / length;
      // The normal closest to perpendicular leans by the cone's half angle.
      const double pi = std::acos(-1.0);
      outline = std::abs(std::asin(along)) <= cone.half_angle_degrees * pi / 180.0;
    }
    if (outline && without_cone > 0.0) {
      ASSERT_EQ(with_cone, 4.0 * without_cone);
      ++outlines;
    }
    plains += with_cone == without_cone;
  }
  EXPECT_GT(outlines, 30);
  EXPECT_GT(plains, 30);
}

TEST(ViewMeasure, TerrainConeIsTheSlopeOfTheBox) {
  EXPECT_NEAR(terrain_cone({{{0, 0, 5}, {10, 20, 15}}, 1.0, 1}).half_angle_degrees, 45.0, 1e-9);
  EXPECT_EQ(terrain_cone({{{0, 0, 5}, {10, 20, 5}}, 1.0, 1}).half_angle_degrees, 0.0);
  EXPECT_EQ(terrain_cone({{{0, 0, 5}, {0, 20, 5}}, 1.0, 1}).half_angle_degrees, 90.0);
}

}  // namespace
}  // namespace terrace::tri::test
