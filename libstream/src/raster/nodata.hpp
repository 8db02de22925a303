// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The raw samples that mean nodata: the closed range [low, high] of the sample type, empty if
/// low > high. Of floats, NaN and the infinities always do. It is a range because the text of a
/// float is often rounded to fewer digits than the float has.
struct NodataRule {
  std::optional<double> value;                     ///< the value in the file, if it has one
  bool unmatched = false;                          ///< no sample of this type can have that value
  double low = 1, high = 0;                        ///< the range of floats
  std::int64_t low_integer = 1, high_integer = 0;  ///< range for integers except u64
  std::uint64_t low_unsigned = 1, high_unsigned = 0;  ///< range for u64

  /// Parses a file's text (GDAL_NODATA) for samples of `type`, as GDAL does. Accepts "nan", "inf"
  /// and "-inf" in any case, and decimals for integer samples ("-9999.0"). Floats match within two
  /// units in the last place. Returns an empty range for an empty or unreadable text.
  static NodataRule parse(const std::string& text, ScalarType type);
};

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
