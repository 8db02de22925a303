// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "raster_nodata.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// A row of native samples on its way into a window.
struct SampleRow {
  const std::byte* samples = nullptr;
  std::size_t step = 1;  ///< samples from one cell to the next (bands side by side)
  std::size_t cells = 0;
};

/// Lays the valid samples of `row` over `out`, `valid` (see Raster::read_over); returns whether
/// there were any. `out` need not be aligned.
bool overlay_row(ScalarType type, const SampleRow& row, const NodataRule& rule, std::byte* out,
                 std::uint8_t* valid);

/// Calls `f` with a value of the C++ type of `type`.
template <class F>
decltype(auto) with_type(ScalarType type, F&& f) {
  switch (type) {
    case ScalarType::i8:
      return f(std::int8_t{});
    case ScalarType::u8:
      return f(std::uint8_t{});
    case ScalarType::i16:
      return f(std::int16_t{});
    case ScalarType::u16:
      return f(std::uint16_t{});
    case ScalarType::i32:
      return f(std::int32_t{});
    case ScalarType::u32:
      return f(std::uint32_t{});
    case ScalarType::i64:
      return f(std::int64_t{});
    case ScalarType::u64:
      return f(std::uint64_t{});
    case ScalarType::f32:
      return f(float{});
    case ScalarType::f64:
      break;
  }
  return f(double{});
}

}  // namespace terrace::stream
