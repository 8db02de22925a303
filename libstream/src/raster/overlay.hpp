// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "raster/nodata.hpp"
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

}  // namespace terrace::stream
