// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// How far a mesh is from the samples of a raster window, found independently of what made it.

namespace terrace::tri {

using Point3 = std::array<double, 3>;

/// Samples on a lattice, row by row. Heights that are not finite are no data.
template <class T>
struct GridWindow {
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  std::span<const T> heights;
};

struct GridTinCheck {
  double max_error = 0;  ///< vertically, over the covered samples
  double rms_error = 0;
  std::size_t samples = 0;                  ///< with data
  std::size_t covered = 0;                  ///< of these, in a triangle
  std::size_t uncovered = 0;                ///< of these, in none
  std::vector<std::uint32_t> uncovered_at;  ///< their numbers, row by row
  /// Of the uncovered ones, those whose 8 neighbours (as far as they are in the window) have data.
  std::size_t uncovered_inner = 0;
  std::size_t nodata_covered = 0;  ///< samples without data that are in a triangle
  std::size_t turned = 0;          ///< triangles without area or turned against the first one
};

/// Looks at every sample in every triangle, sides and corners included, in double. Points are
/// column, row and height, not necessarily on the lattice: the values that the reader of a file
/// gets back, which may have been rounded. `tolerance`, in cells, is how far they may have moved:
/// samples that are outside a triangle by no more count as covered by it, with its plane continued;
/// samples without data count only if they are inside. O(samples + triangles + points), memory for
/// one byte per sample and four per uncovered one.
///
/// Throws std::invalid_argument for `heights` of the wrong length, a corner that is not the number
/// of a point, a point that is not finite or (column, row) more than 2^20 away from the window, and
/// a tolerance that is not in [0, 1].
template <class T>
GridTinCheck check_grid_tin(const GridWindow<T>& window, std::span<const Point3> points,
                            std::span<const std::array<std::uint32_t, 3>> triangles,
                            double tolerance = 0);

extern template GridTinCheck check_grid_tin(const GridWindow<float>&, std::span<const Point3>,
                                            std::span<const std::array<std::uint32_t, 3>>, double);
extern template GridTinCheck check_grid_tin(const GridWindow<double>&, std::span<const Point3>,
                                            std::span<const std::array<std::uint32_t, 3>>, double);

}  // namespace terrace::tri
