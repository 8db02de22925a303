// SPDX-License-Identifier: Apache-2.0
#include "mesh/scene.hpp"

#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/stop_check.hpp>

namespace terrace::terrain {
namespace {

TriangleMesh tetrahedron() {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

TEST(HeightField, HasNoOverlapSeenFromAbove) {
  TriangleMesh flat;
  flat.positions = {{0, 0, 3}, {1, 0, 1}, {0, 1, 7}, {1, 1, -2}};
  flat.triangles = {{0, 1, 2}, {1, 3, 2}};
  EXPECT_TRUE(is_height_field(flat));
  flat.triangles[1] = {1, 2, 3};  // inverted
  EXPECT_FALSE(is_height_field(flat));
  EXPECT_FALSE(is_height_field(tetrahedron()));
  EXPECT_FALSE(is_height_field(TriangleMesh{}));
}

TEST(VertexNormals, AreUnitVectorsPointingOutward) {
  const TriangleMesh mesh = tetrahedron();
  const auto normals = vertex_normals(mesh);
  ASSERT_EQ(normals.size(), 4u);
  for (std::size_t v = 0; v < 4; ++v) {
    double length = 0, outward = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      length += normals[v][axis] * normals[v][axis];
      outward += normals[v][axis] * (mesh.positions[v][axis] - 0.25);
    }
    EXPECT_NEAR(length, 1, 1e-6);
    EXPECT_GT(outward, 0);
  }
}

TEST(VertexNormals, PointUpOnTerrainInAnyOrientation) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {9, 9, 9}};
  for (const std::array<std::uint32_t, 3> t : {std::array<std::uint32_t, 3>{0, 1, 2}, {0, 2, 1}}) {
    mesh.triangles = {t};
    EXPECT_EQ(vertex_normals(mesh)[0][2], 1);
    EXPECT_EQ(vertex_normals(mesh)[3][2], 1);  // a vertex without triangles
  }
}

TEST(Scene, StopsWhenRequested) {
  struct Stop {};
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < 100'000; ++i) {
    mesh.positions.push_back({i % 2 + 0.0, i + 0.0, i % 3 + 0.0});
    if (i >= 2) mesh.triangles.push_back({i - 2, i - 1, i});
  }
  TriangleMesh cloud;
  cloud.positions = mesh.positions;
  cloud.left_out.assign(cloud.positions.size(), 1);
  const std::vector<double> heights(mesh.positions.size(), 1.0);
  const std::vector<std::function<void(const base::StopCheck&)>> works{
      [&](const base::StopCheck& check) { is_height_field(mesh, check); },
      [&](const base::StopCheck& check) { mostly_steep(mesh, check); },
      [&](const base::StopCheck& check) { rms_slope(mesh, check); },
      [&](const base::StopCheck& check) { vertex_normals(mesh, check); },
      [&](const base::StopCheck& check) { shown_heights(mesh, heights, true, check); },
      [&](const base::StopCheck& check) { shown_heights(cloud, heights, true, check); }};
  for (std::size_t k = 0; k < works.size(); ++k) {
    SCOPED_TRACE(k);
    std::size_t calls = 0;
    works[k]([&] { ++calls; });
    const std::size_t all = calls;
    ASSERT_GE(all, 10U);
    calls = 0;
    EXPECT_THROW(works[k]([&] {
                   if (++calls == all) throw Stop();
                 }),
                 Stop);
    EXPECT_EQ(calls, all);
  }
}

}  // namespace
}  // namespace terrace::terrain
