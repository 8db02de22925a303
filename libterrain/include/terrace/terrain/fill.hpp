// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace terrace::terrain {

/// What the places become that have no data: cells of a raster, and what is beyond it or beyond the
/// hull of irregular points where a surface has to go on there.
enum class Fill : std::uint8_t {
  none,         ///< holes
  flat,         ///< one height, the lowest of the store if none is given
  interpolate,  ///< heights between those around; of tiles 0 beyond the outline of the data
};

}  // namespace terrace::terrain
