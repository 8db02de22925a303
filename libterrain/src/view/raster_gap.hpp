// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include <terrace/stream/store.hpp>

namespace terrace::terrain {

/// Whether a triangle in the Delaunay triangulation (without a metric) of some clusters of a raster
/// spans samples without data. Such a triangle's corners are not neighbours in columns and rows,
/// and its centroid is farther than a cell from the boxes of all clusters that are not expanded. A
/// sample within a cell of the centroid is either in such a box or a vertex, so a raster without
/// gaps has no such triangle.
///
/// far(cells): whether no such box meets the columns and rows within a cell of a place, with
/// heights {0, 0}.
template <class Far>
bool spans_gap(const std::array<std::array<std::int32_t, 2>, 3>& corners, const Far& far) {
  stream::Box3 cells{{0, 0, 0}, {0, 0, 0}};
  bool neighbours = true;
  for (std::size_t k = 0; k < 2; ++k) {
    const double a = corners[0][k], b = corners[1][k], c = corners[2][k];
    neighbours = neighbours && std::max({a, b, c}) - std::min({a, b, c}) <= 1;
    cells.min[k] = (a + b + c) / 3 - 1;
    cells.max[k] = (a + b + c) / 3 + 1;
  }
  return !neighbours && far(cells);
}

/// Whether a store is a raster with cells inside its bounds that have no data or that a view's
/// condition excludes.
inline bool has_gaps(const stream::Store& store) {
  if (!store.schema().grid || store.points() == 0) return false;
  if (store.condition() != nullptr) return true;
  const stream::Box3& bounds = store.bounds();
  return (bounds.max[0] - bounds.min[0] + 1) * (bounds.max[1] - bounds.min[1] + 1) >
         static_cast<double>(store.points());
}

}  // namespace terrace::terrain
