// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/triangle_mesh.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
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

TEST(TriangleMesh, TakesTheAttributesThatItHasColumnsFor) {
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
  // 16 bits as they are, 8 bits and floats spread over 16.
  for (const auto& colour : mesh.colours) {
    EXPECT_EQ(colour, (std::array<std::uint16_t, 3>{1000, 65535, 257}));
  }
  EXPECT_EQ(mesh.colours.size(), 3u);
  EXPECT_EQ(mesh.classes, (std::vector<std::int32_t>{2, 2, 2}));
  EXPECT_EQ(mesh.levels, (std::vector<std::uint8_t>{3, 255, 0}));
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_TRUE(mesh.representatives.empty());
}

}  // namespace
}  // namespace terrace::terrain
