// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/triangle_mesh.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace terrace::terrain {
namespace {

template <class T>
void append(std::vector<std::byte>& record, T value) {
  std::array<std::byte, sizeof value> bytes{};
  std::memcpy(bytes.data(), &value, sizeof value);
  record.insert(record.end(), bytes.begin(), bytes.end());
}

TEST(TriangleMesh, ReadsAttributesWithColumns) {
  stream::MeshFile file;
  using stream::ScalarType;
  file.info.attributes = {{.name = "intensity", .type = ScalarType::u16},
                          {.name = "red", .type = ScalarType::u16},
                          {.name = "green", .type = ScalarType::u8},
                          {.name = "blue", .type = ScalarType::f32},
                          {.name = "classification", .type = ScalarType::u8},
                          {.name = "level", .type = ScalarType::f64}};
  file.vertices.positions = {{1, 2, 3}, {4, 5, 6}, {7, 8, 10}};
  for (const double level : {3.0, 1e9, -1.0}) {
    append<std::uint16_t>(file.vertices.payload, 7);
    append<std::uint16_t>(file.vertices.payload, 1000);
    append<std::uint8_t>(file.vertices.payload, 255);
    append<float>(file.vertices.payload, 1.0F);
    append<std::uint8_t>(file.vertices.payload, 2);
    append<double>(file.vertices.payload, level);
  }
  file.triangles = {{0, 1, 2}};
  const auto positions = file.vertices.positions;
  const TriangleMesh mesh = triangle_mesh_of(std::move(file));
  EXPECT_EQ(mesh.positions, positions);
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}}));
  // 16 bits unchanged, 8 bits and floats scaled to 16.
  for (const auto& colour : mesh.colours) {
    EXPECT_EQ(colour, (std::array<std::uint16_t, 3>{1000, 65535, 257}));
  }
  EXPECT_EQ(mesh.colours.size(), 3u);
  EXPECT_EQ(mesh.classes, (std::vector<std::int32_t>{2, 2, 2}));
  EXPECT_EQ(mesh.levels, (std::vector<std::uint8_t>{3, 255, 0}));
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_TRUE(mesh.representatives.empty());
}

MeshUnits units_of(int epsg, const std::string& unit, const std::string& heights = {}) {
  MeshUnits units;
  units.crs.epsg = epsg;
  units.crs.geographic = unit == "degree";
  units.crs.horizontal_unit = unit;
  units.height_unit = heights;
  return units;
}

TEST(MeshCoordinates, AreMetresInGlbForAnyUnits) {
  const auto frame_of = [](const MeshUnits& units, const stream::Box3& bounds) {
    return mesh_coordinates("m.glb", {}, units, bounds).frame;
  };
  const stream::Box3 degrees{{8, 46, 0}, {9, 47, 4000}};
  const auto feet_high = frame_of(units_of(4326, "degree", "foot"), degrees);
  ASSERT_TRUE(feet_high);
  EXPECT_TRUE(feet_high->local);
  EXPECT_NEAR(feet_high->metres[0], 76713, 50);
  EXPECT_NEAR(feet_high->metres[1], 111160, 20);
  EXPECT_EQ(feet_high->metres[2], 0.3048);
  EXPECT_EQ(feet_high->crs, "EPSG:4326");
  // At the pole, where there is no east.
  const auto pole = frame_of(units_of(4326, "degree"), {{-180, 90, 0}, {180, 90, 0}});
  ASSERT_TRUE(pole);
  EXPECT_GT(pole->metres[0], 0);
  // The caller's own numbers, which are not latitudes.
  EXPECT_FALSE(frame_of(units_of(4326, "degree"), {{400000, 5000000, 0}, {500000, 5100000, 9}}));
  const auto feet = frame_of(units_of(0, "foot"), {{0, 0, 0}, {1000, 1000, 9}});
  ASSERT_TRUE(feet);
  EXPECT_FALSE(feet->local);
  EXPECT_EQ(feet->metres, (stream::Point3{0.3048, 0.3048, 0.3048}));
  EXPECT_FALSE(frame_of(units_of(0, ""), degrees));
  EXPECT_FALSE(frame_of(units_of(0, "metre"), degrees));
  EXPECT_FALSE(frame_of(units_of(4326, "degree"), {}));
  EXPECT_FALSE(mesh_coordinates("m.ply", {}, units_of(4326, "degree"), degrees).frame);
}

TEST(MeshCoordinates, NotesNameTheRemedy) {
  const auto note = [](const char* path, const MeshUnits& units, const stream::Box3& bounds) {
    return mesh_coordinates(path, {}, units, bounds).note.text();
  };
  const stream::Box3 south{{170, -45, 0}, {171, -44, 4000}}, globe{{-180, -90, 0}, {180, 90, 1}};
  EXPECT_NE(note("m.obj", units_of(4326, "degree"), south).find("`to_crs` EPSG:32759 for metres"),
            std::string::npos);
  EXPECT_NE(
      note("m.glb", units_of(4326, "degree"), globe).find("`to_crs` EPSG:n, is more accurate"),
      std::string::npos);
  EXPECT_EQ(note("m.ply", units_of(32632, "metre"), {{0, 5e6, 0}, {1e5, 5.1e6, 0}}), "");
  EXPECT_EQ(note("m.ply", units_of(0, "foot", "foot"), south), "");
  EXPECT_NE(note("m.ply", units_of(0, "foot", "metre"), south).find("x and y are feet and heights"),
            std::string::npos);
}

}  // namespace
}  // namespace terrace::terrain
