// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "terrace/tri/shape.hpp"

namespace terrace::tri {
namespace {

Surface tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

TEST(SurfaceTest, EmptySurfaceIsClosed) {
  const SurfaceMeasures measured = measure({});
  EXPECT_TRUE(measured.closed);
  EXPECT_EQ(measured.components, 0u);
  EXPECT_EQ(measured.area, 0.0);
}

TEST(SurfaceTest, MeasuresATetrahedron) {
  const SurfaceMeasures measured = measure(tetrahedron());
  EXPECT_EQ(measured.faces, 4u);
  EXPECT_EQ(measured.vertices, 4u);
  EXPECT_EQ(measured.edges, 6u);
  EXPECT_NEAR(measured.area, 1.5 + std::sqrt(3) / 2, 1e-12);
  EXPECT_NEAR(measured.volume, 1.0 / 6, 1e-12);
  EXPECT_EQ(measured.components, 1u);
  EXPECT_EQ(measured.euler_characteristic, 2);
  EXPECT_EQ(measured.border_edges, 0u);
  EXPECT_EQ(measured.non_manifold_edges, 0u);
  EXPECT_TRUE(measured.closed);
}

TEST(SurfaceTest, MeasuresOpenAndTurnedSurfaces) {
  Surface surface = tetrahedron();
  surface.faces.pop_back();
  SurfaceMeasures measured = measure(surface);
  EXPECT_FALSE(measured.closed);
  EXPECT_EQ(measured.border_edges, 3u);
  EXPECT_EQ(measured.euler_characteristic, 1);
  surface = tetrahedron();
  std::swap(surface.faces[3][0], surface.faces[3][1]);
  measured = measure(surface);
  EXPECT_FALSE(measured.closed);
  EXPECT_EQ(measured.border_edges, 0u);
}

TEST(SurfaceTest, MeasuresTwoThatShareAnEdge) {
  Surface surface = tetrahedron();
  surface.points.push_back({-1, 0, 0});
  surface.points.push_back({0, -1, 0});
  for (auto face : tetrahedron().faces) {
    for (auto& v : face) v = v == 1 ? 4 : v == 2 ? 5 : v;  // rotates about the axis through 0 and 3
    surface.faces.push_back(face);
  }
  const SurfaceMeasures measured = measure(surface);
  EXPECT_TRUE(measured.closed);
  EXPECT_EQ(measured.components, 1u);
  EXPECT_EQ(measured.non_manifold_edges, 1u);
  EXPECT_NEAR(measured.volume, 1.0 / 3, 1e-12);
  EXPECT_EQ(measured.euler_characteristic, 6 - 11 + 8);
}

TEST(SurfaceTest, MeasuresTwoApartAndUnusedPoints) {
  Surface surface = tetrahedron();
  surface.points.resize(7, {9, 9, 9});
  for (const auto& p : tetrahedron().points) surface.points.push_back({p[0] + 5, p[1], p[2]});
  for (const auto& f : tetrahedron().faces) surface.faces.push_back({f[0] + 7, f[1] + 7, f[2] + 7});
  const SurfaceMeasures measured = measure(surface);
  EXPECT_EQ(measured.components, 2u);
  EXPECT_EQ(measured.vertices, 8u);
  EXPECT_EQ(measured.euler_characteristic, 4);
  EXPECT_TRUE(measured.closed);
}

TEST(SurfaceTest, ComponentsAreTurnedOutward) {
  Surface surface = tetrahedron();
  for (const auto& p : tetrahedron().points) surface.points.push_back({p[0] + 5, p[1], p[2]});
  for (const auto& f : tetrahedron().faces) surface.faces.push_back({f[0] + 4, f[2] + 4, f[1] + 4});
  const auto first = tetrahedron().faces;
  EXPECT_NEAR(measure(surface).volume, 0.0, 1e-12);
  turn_outward(surface);
  EXPECT_NEAR(measure(surface).volume, 1.0 / 3, 1e-12);
  EXPECT_TRUE(std::equal(first.begin(), first.end(), surface.faces.begin()));
  surface.faces[0][0] = 99;
  EXPECT_THROW(turn_outward(surface), std::invalid_argument);
}

TEST(SurfaceTest, VolumeIsAccurateFarFromTheOrigin) {
  Surface surface = tetrahedron();
  for (auto& p : surface.points)
    for (double& c : p) c += 0x1p40;
  EXPECT_NEAR(measure(surface).volume, 1.0 / 6, 1e-12);
}

TEST(SurfaceTest, ErrorsNameBadFaces) {
  const auto message = [](const Surface& surface) -> std::string {
    try {
      measure(surface);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  Surface surface = tetrahedron();
  surface.faces[2][1] = 4;
  EXPECT_NE(message(surface).find("face 2"), std::string::npos) << message(surface);
  surface.faces[2][1] = surface.faces[2][0];
  EXPECT_NE(message(surface).find("face 2"), std::string::npos) << message(surface);
}

}  // namespace
}  // namespace terrace::tri
