// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "noisy_bodies.hpp"
#include "terrace/tri/shape.hpp"

namespace terrace::tri {
namespace vertex_normals_test {

using noisy_bodies::cross;
using noisy_bodies::cube;
using noisy_bodies::dot;
using noisy_bodies::doubled_normal;
using noisy_bodies::length;
using noisy_bodies::minus;
using noisy_bodies::sheet;
using noisy_bodies::sphere;
using noisy_bodies::torus;
using noisy_bodies::with_noise;

TEST(VertexNormals, FollowThePlainFormula) {
  for (const Surface& surface :
       {with_noise(torus(4, 1.5, 30, 12), 0.1, 1), with_noise(cube(5), 0.2, 2)}) {
    std::vector<Point3> expected(surface.points.size());
    for (const auto& face : surface.faces) {
      const Point3 n = doubled_normal(surface, face);
      for (std::size_t i = 0; i < 3; ++i) {
        const Point3 a = minus(surface.points[face[(i + 1) % 3]], surface.points[face[i]]);
        const Point3 b = minus(surface.points[face[(i + 2) % 3]], surface.points[face[i]]);
        const double angle = std::acos(dot(a, b) / (length(a) * length(b)));
        for (std::size_t k = 0; k < 3; ++k) expected[face[i]][k] += angle * n[k] / length(n);
      }
    }
    const auto normals = vertex_normals(surface);
    for (std::size_t v = 0; v < normals.size(); ++v) {
      EXPECT_NEAR(length(normals[v]), 1, 1e-15);
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_NEAR(normals[v][k], expected[v][k] / length(expected[v]), 1e-12);
    }
  }
}

TEST(VertexNormals, DoNotDependOnTheDiagonals) {
  const Surface body = cube(4);
  const auto normals = vertex_normals(body);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    Point3 outward{};
    for (std::size_t k = 0; k < 3; ++k) {
      outward[k] = body.points[v][k] == 0 ? -1 : body.points[v][k] == 4 ? 1 : 0;
    }
    const double l = length(outward);
    for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(normals[v][k], outward[k] / l, 1e-14);
  }
}

TEST(VertexNormals, PointOutwardOnASphereAndAlongTheNormalOfAPlane) {
  const Surface ball = sphere(3, 5);
  const auto normals = vertex_normals(ball);
  for (std::size_t v = 0; v < normals.size(); ++v)
    ASSERT_GT(dot(normals[v], ball.points[v]) / 3, 0.9999);
  const auto flat = vertex_normals(sheet(9, 9, 1, [](double x, double y) { return x - 2 * y; }));
  for (const Point3& n : flat) {
    ASSERT_NEAR(n[0], -1 / std::sqrt(6.0), 1e-13);
    ASSERT_NEAR(n[1], 2 / std::sqrt(6.0), 1e-13);
    ASSERT_NEAR(n[2], 1 / std::sqrt(6.0), 1e-13);
  }
}

TEST(VertexNormals, ThreadsAndScalesDoNotMatter) {
  const Surface body = with_noise(torus(50, 10, 200, 60), 0.1, 3);
  const auto one = vertex_normals(body);
  EXPECT_EQ(vertex_normals(body, 5), one);
  EXPECT_EQ(vertex_normals(body, 0), one);
  for (const double scale : {0x1p-1000, 0x1p900}) {
    Surface scaled = body;
    for (Point3& p : scaled.points)
      for (double& x : p) x *= scale;
    EXPECT_EQ(vertex_normals(scaled), one);
  }
}

TEST(VertexNormals, AreZeroWhereFacesHaveNoDirection) {
  EXPECT_TRUE(vertex_normals({}).empty());
  const Surface strange{
      {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {5, 5, 5}, {0, 0, 3}, {1, 0, 3}, {0, 1, 3}},
      {{0, 1, 2}, {0, 0, 3}, {5, 6, 7}, {5, 7, 6}}};
  for (const Point3& n : vertex_normals(strange)) EXPECT_EQ(n, Point3{});
  Surface wrong = strange;
  wrong.faces.push_back({0, 1, 8});
  EXPECT_THROW(static_cast<void>(vertex_normals(wrong)), std::invalid_argument);
  wrong = strange;
  wrong.points[1][0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(static_cast<void>(vertex_normals(wrong)), std::invalid_argument);
}

}  // namespace vertex_normals_test
}  // namespace terrace::tri
