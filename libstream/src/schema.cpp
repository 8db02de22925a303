// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/schema.hpp"

#include <array>
#include <utility>

#include "with_type.hpp"

namespace terrace::stream {
namespace {

struct Row {
  ScalarType type;
  std::size_t size;
  std::string_view name, ply_name;
};

constexpr std::array<Row, 10> kTypes{{{ScalarType::i8, 1, "int8", "char"},
                                      {ScalarType::u8, 1, "uint8", "uchar"},
                                      {ScalarType::i16, 2, "int16", "short"},
                                      {ScalarType::u16, 2, "uint16", "ushort"},
                                      {ScalarType::i32, 4, "int32", "int"},
                                      {ScalarType::u32, 4, "uint32", "uint"},
                                      {ScalarType::i64, 8, "int64", ""},
                                      {ScalarType::u64, 8, "uint64", ""},
                                      {ScalarType::f32, 4, "float32", "float"},
                                      {ScalarType::f64, 8, "float64", "double"}}};

}  // namespace

std::size_t size_of(ScalarType type) { return kTypes[static_cast<std::size_t>(type)].size; }

std::string_view name_of(ScalarType type) { return kTypes[static_cast<std::size_t>(type)].name; }

std::optional<ScalarType> scalar_type_of(std::string_view name) {
  for (const Row& row : kTypes) {
    if (!name.empty() && (name == row.name || name == row.ply_name)) return row.type;
  }
  return std::nullopt;
}

double to_double(ScalarType type, const std::byte* bytes) {
  return with_type(type, [bytes](auto value) {
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
  });
}

std::optional<Lattice> lattice_of(const Placement& placement) {
  for (const Channel& channel : placement.coordinates) {
    if (channel.type > ScalarType::u32) return std::nullopt;
  }
  const std::array<double, 6>& xy = placement.world.xy;
  if (xy[1] != 0.0 || xy[3] != 0.0) return std::nullopt;
  const Channel& z = placement.coordinates[2];
  return Lattice{.scale = {xy[0], xy[4], z.scale}, .offset = {xy[2], xy[5], z.offset}};
}

Box3 world_box(const Placement& placement, const Box3& stored) {
  Box3 box;
  if (stored.empty()) return box;
  for (unsigned corner = 0; corner < 8; ++corner) {
    box.include(world_point(placement, {(corner & 1) != 0 ? stored.max[0] : stored.min[0],
                                        (corner & 2) != 0 ? stored.max[1] : stored.min[1],
                                        (corner & 4) != 0 ? stored.max[2] : stored.min[2]}));
  }
  return box;
}

std::array<double, 2> stored_place(const Placement& placement, const std::array<double, 2>& world) {
  const std::array<double, 6>& xy = placement.world.xy;
  const double x = world[0] - xy[2], y = world[1] - xy[5];
  if (xy[1] == 0.0 && xy[3] == 0.0) return {x / xy[0], y / xy[4]};
  const double determinant = xy[0] * xy[4] - xy[1] * xy[3];
  return {(xy[4] * x - xy[1] * y) / determinant, (xy[0] * y - xy[3] * x) / determinant};
}

std::array<double, 2> border_tolerance(const Schema& schema) {
  if (!schema.grid) return {};
  const std::array<double, 6>& xy = schema.world.xy;
  return {1e-6 * (std::abs(xy[0]) + std::abs(xy[1])), 1e-6 * (std::abs(xy[3]) + std::abs(xy[4]))};
}

std::size_t Schema::attribute_offset(std::size_t attribute) const {
  std::size_t offset = 0;
  for (std::size_t i = 0; i < attribute; ++i) offset += size_of(attributes[i].type);
  return offset;
}

}  // namespace terrace::stream
