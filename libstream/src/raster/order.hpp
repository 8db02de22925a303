// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// What the window of a raster may take of a source's memory. The order of the points depends on it
/// and must not depend on how much memory there is: it ends at that of 64 MiB.
inline std::uint64_t window_bytes(std::uint64_t memory_bytes) {
  return std::min<std::uint64_t>(memory_bytes, 64u << 20) / 4 * 3;
}

/// A number of columns and rows.
struct GridSize {
  std::uint64_t columns = 0, rows = 0;
};

/// Cells of a tile that is as square on the ground as can be and has at most `cells` cells.
/// `aspect`: ground height / width of a cell.
GridSize ground_square(std::uint64_t cells, double aspect);

/// Into how many tiles a window is divided evenly so that none has more than `cells` cells and each
/// is about square on the ground. Part i of n of a length L begins at cell i * L / n.
GridSize tiles_of(GridSize window, std::uint64_t cells, double aspect);

/// The fields of a rectangle along a generalised Hilbert curve (for sides of any length; steps go
/// to a neighbour, once in a while diagonally), as row * columns + column. Begins at field 0; ends
/// in the other corner of the longer side. Source: J. Cerveny, "Generalized Hilbert space-filling
/// curve for rectangular domains of arbitrary (non-power of two) sizes", 2018.
std::vector<std::uint32_t> hilbert_order(std::uint32_t columns, std::uint32_t rows);

/// The window that is read at once, in cells: about 16 x 16 tiles or more, whole blocks of the
/// raster where that is possible, and at most `cells` cells if blocks allow it. The raster is read
/// in rows of such windows.
GridSize window_size(const RasterInfo& info, std::uint64_t cells, std::uint64_t tile_cells,
                     double aspect);

}  // namespace terrace::stream
