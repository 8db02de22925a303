// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <utility>

#include "terrace/stream/source.hpp"

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

void PointBlock::clear() {
  positions.clear();
  for (Column& column : attributes) column.bytes.clear();
}

}  // namespace terrace::stream
