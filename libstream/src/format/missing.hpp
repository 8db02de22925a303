// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// True if a coordinate is NaN, which is how scanners and photogrammetry write "no return". Readers
/// of points and meshes, in files or arrays, drop such points and count them as nodata.
inline bool is_missing(const Point3& point) {
  return std::isnan(point[0]) || std::isnan(point[1]) || std::isnan(point[2]);
}

inline bool is_infinite(const Point3& point) {
  return std::isinf(point[0]) || std::isinf(point[1]) || std::isinf(point[2]);
}

/// Removes the missing points and their payload records of `record` bytes each. Returns how many
/// were removed.
inline std::size_t remove_missing(PointBlock& block, std::size_t record) {
  std::size_t remaining = 0;
  for (std::size_t i = 0; i < block.size(); ++i) {
    if (is_missing(block.positions[i])) continue;
    block.positions[remaining] = block.positions[i];
    std::copy_n(block.payload.data() + i * record, record,
                block.payload.data() + remaining * record);
    ++remaining;
  }
  const std::size_t missing = block.size() - remaining;
  block.positions.resize(remaining);
  block.payload.resize(remaining * record);
  return missing;
}

}  // namespace terrace::stream
