// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "terrace/stream/point.hpp"
#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// A scalar column in rows of `stride` bytes: value i is at rows + i * stride.
struct PackedColumn {
  const char* rows = nullptr;
  std::size_t stride = 0;
  std::size_t count = 0;
  ScalarType type = ScalarType::f32;
  bool swap = false;  ///< the bytes are not in native order
};

/// Copies the column into coordinate `axis` of `points`.
void decode_coordinate(const PackedColumn& column, Point3* points, std::size_t axis);
/// Copies the column's values to `target`, `target_stride` bytes apart, in native byte order.
/// `target` may be the rows themselves.
void decode_values(const PackedColumn& column, std::byte* target, std::size_t target_stride);

/// Returns the value of an integer type at `raw`; negative ones keep their sign, uint64 wraps to
/// negative.
std::int64_t to_integer(const std::byte* raw, ScalarType type);

/// Reads the number that starts at `at` as `type` and stores it at `raw`. Integers may be written
/// like "3.0". Returns the position after it, or null if the text up to the next blank or `end` is
/// not a number in that type's range.
const char* parse_scalar(const char* at, const char* end, ScalarType type, std::byte* raw);

}  // namespace terrace::stream
