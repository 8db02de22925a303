// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

/// Constants that the writer and the reader of tiles share.

namespace terrace::terrain {

enum class TileExtension : std::uint8_t { oct_normals = 1, water_mask = 2, metadata = 4 };

/// With more vertices than this, indices have 32 bits.
inline constexpr std::size_t kMostShortVertices = 65536;
/// Number of cells in a water mask that is not uniform.
inline constexpr std::size_t kWaterCells = std::size_t{256} * 256;

}  // namespace terrace::terrain
