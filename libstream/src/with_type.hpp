// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <utility>

#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// Calls visit(T{}) with the C++ type T for `type`.
template <class Visit>
decltype(auto) with_type(ScalarType type, Visit&& visit) {
  switch (type) {
    case ScalarType::i8:
      return visit(std::int8_t{});
    case ScalarType::u8:
      return visit(std::uint8_t{});
    case ScalarType::i16:
      return visit(std::int16_t{});
    case ScalarType::u16:
      return visit(std::uint16_t{});
    case ScalarType::i32:
      return visit(std::int32_t{});
    case ScalarType::u32:
      return visit(std::uint32_t{});
    case ScalarType::i64:
      return visit(std::int64_t{});
    case ScalarType::u64:
      return visit(std::uint64_t{});
    case ScalarType::f32:
      return visit(float{});
    case ScalarType::f64:
      break;
  }
  return visit(double{});
}

}  // namespace terrace::stream
