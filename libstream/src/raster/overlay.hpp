// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "raster/nodata.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// A row of samples in native byte order, to be copied into a window.
struct SampleRow {
  const std::byte* samples = nullptr;
  std::size_t step = 1;  ///< samples from one cell to the next (interleaved bands)
  std::size_t cells = 0;
};

/// Copies the valid samples of `row` over `out` and sets their `valid` (see Raster::read_over).
/// Returns whether any were valid. `out` need not be aligned.
bool overlay_row(ScalarType type, const SampleRow& row, const NodataRule& rule, std::byte* out,
                 std::uint8_t* valid);

}  // namespace terrace::stream
