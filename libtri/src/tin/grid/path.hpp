// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace terrace::tri::tin {

/// The instruction sets that inner loops over rasters are compiled for.
enum class GridPath : std::uint8_t { kPortable, kAvx2, kAvx512 };
bool supported(GridPath path);
GridPath best_grid_path();

}  // namespace terrace::tri::tin
