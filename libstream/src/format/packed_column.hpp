// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

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
/// Copies the column's values to `to`, `to_stride` bytes apart, in native byte order. `to` may be
/// the rows themselves.
void decode_values(const PackedColumn& column, std::byte* to, std::size_t to_stride);

}  // namespace terrace::stream
