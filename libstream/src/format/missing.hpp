// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// True if a coordinate is NaN, which is how scanners and photogrammetry write "no return": files
/// of points and meshes are read without such points and count them as nodata.
inline bool is_missing(const Point3& point) {
  return std::isnan(point[0]) || std::isnan(point[1]) || std::isnan(point[2]);
}

inline bool is_infinite(const Point3& point) {
  return std::isinf(point[0]) || std::isinf(point[1]) || std::isinf(point[2]);
}

}  // namespace terrace::stream
