// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace terrace::terrain {

/// How to fill places without data: cells of a raster, and the area beyond a raster or beyond the
/// hull of irregular points where a surface must continue.
enum class Fill : std::uint8_t {
  none,         ///< holes
  flat,         ///< one height; by default the lowest of the store
  interpolate,  ///< heights between those around; in tiles, 0 beyond the outline of the data
};

}  // namespace terrace::terrain
