// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// Returns the share of a source's memory that the window of a raster may take. The order of the
/// points depends on the window and should not depend on the available memory, so only the first 64
/// MiB count.
inline std::uint64_t window_bytes(std::uint64_t memory_bytes) {
  return std::min<std::uint64_t>(memory_bytes, 64u << 20) / 4 * 3;
}

/// Numbers of columns and rows.
struct GridSize {
  std::uint64_t columns = 0, rows = 0;
};

/// Returns the size of a tile that is as square on the ground as possible and has at most `cells`
/// cells. aspect: height / width of a cell on the ground.
GridSize ground_square(std::uint64_t cells, double aspect);

/// Returns the number of tiles across and down into which a window is divided evenly, so that each
/// tile is nearly square on the ground and has at most `cells` cells. Part i of n of a length L
/// begins at cell i * L / n.
GridSize tiles_of(GridSize window, std::uint64_t cells, double aspect);

/// Returns the fields of a rectangle, as row * columns + column, along a generalised Hilbert curve,
/// which allows sides of any length. Each step goes to a neighbour, occasionally a diagonal one.
/// The curve begins at field 0 and ends at the other corner of the longer side. Source: J. Cerveny,
/// "Generalized Hilbert space-filling curve for rectangular domains of arbitrary (non-power of two)
/// sizes", 2018.
std::vector<std::uint32_t> hilbert_order(std::uint32_t columns, std::uint32_t rows);

/// Returns the size of the window that is read at once, in cells: at least about 16 x 16 tiles,
/// complete blocks of the raster if possible, and at most `cells` cells if blocks allow it. The
/// raster is read in rows of such windows.
GridSize window_size(const RasterInfo& info, std::uint64_t cells, std::uint64_t tile_cells,
                     double aspect);

}  // namespace terrace::stream
