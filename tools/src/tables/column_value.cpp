// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/column_value.hpp"

#include <cstdint>

namespace terrace::tools {

double value_at(const stream::Column& column, std::size_t i) {
  using stream::ScalarType;
  switch (column.type) {
    case ScalarType::i8:
      return column.as<std::int8_t>()[i];
    case ScalarType::u8:
      return column.as<std::uint8_t>()[i];
    case ScalarType::i16:
      return column.as<std::int16_t>()[i];
    case ScalarType::u16:
      return column.as<std::uint16_t>()[i];
    case ScalarType::i32:
      return column.as<std::int32_t>()[i];
    case ScalarType::u32:
      return column.as<std::uint32_t>()[i];
    case ScalarType::i64:
      return static_cast<double>(column.as<std::int64_t>()[i]);
    case ScalarType::u64:
      return static_cast<double>(column.as<std::uint64_t>()[i]);
    case ScalarType::f32:
      return column.as<float>()[i];
    case ScalarType::f64:
      return column.as<double>()[i];
  }
  return 0;
}

}  // namespace terrace::tools
