// SPDX-License-Identifier: Apache-2.0
#include "surface/store_fill.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>

#include "terrace/terrain/detail.hpp"

namespace terrace::terrain {
namespace {

constexpr std::uint64_t kMostCells = std::uint64_t{1} << 20;
constexpr std::uint64_t kMostPoints = std::uint64_t{1} << 23;

/// How the means are taken: from which level, in which cells.
struct Layout {
  Detail detail;
  std::array<double, 2> from{}, cell{1.0, 1.0};
  std::array<std::size_t, 2> size{1, 1};
};

/// Squares of samples. The points of level 1 lie close enough for a surface that nothing measures.
Layout of_raster(const stream::Store& store) {
  const std::array<std::uint64_t, 2> samples{store.schema().columns, store.schema().rows};
  std::uint64_t reduction = 1;
  const auto reduced = [&](std::size_t axis) {
    return (samples[axis] + reduction - 1) / reduction;
  };
  while (reduced(0) * reduced(1) > kMostCells) ++reduction;
  Layout layout;
  layout.detail.level = std::min(1U, store.top());
  for (std::size_t axis = 0; axis < 2; ++axis) {
    layout.from[axis] = -0.5;
    layout.cell[axis] = static_cast<double>(reduction);
    layout.size[axis] = static_cast<std::size_t>(reduced(axis));
  }
  return layout;
}

/// The finest level that is not too large, and about a point to a cell, so that the surface fits to
/// those at the border.
Layout of_points(const stream::Store& store) {
  Layout layout;
  unsigned& level = layout.detail.level;
  while (level < store.top() && store.levels()[level].points > kMostPoints) ++level;
  const std::uint64_t points = store.levels()[level].points;
  const auto cells = static_cast<double>(std::clamp<std::uint64_t>(points, 1, kMostCells));
  const stream::Box3& box = store.bounds();
  const double width = box.max[0] - box.min[0], height = box.max[1] - box.min[1];
  std::array<std::size_t, 2>& size = layout.size;
  if (width > 0.0) {
    const double columns = height > 0.0 ? std::sqrt(cells) * std::sqrt(width / height) : cells;
    size[0] = static_cast<std::size_t>(std::clamp(std::ceil(columns), 1.0, cells));
  }
  if (height > 0.0) size[1] = std::max<std::size_t>(static_cast<std::size_t>(cells) / size[0], 1);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    layout.from[axis] = box.min[axis];
    const double length = box.max[axis] - box.min[axis];
    if (length > 0.0) layout.cell[axis] = length / static_cast<double>(size[axis]);
  }
  return layout;
}

/// The cell of a place; the last one has its end too. Written so that NaN, as a box that is too
/// large for doubles gives it, is in the last.
std::size_t cell_at(double place, std::size_t cells) {
  return place < static_cast<double>(cells - 1) ? static_cast<std::size_t>(place) : cells - 1;
}

}  // namespace

StoreFill::StoreFill(const stream::Store& store) {
  const bool raster = store.schema().grid;
  const Layout layout = raster ? of_raster(store) : of_points(store);
  const std::size_t columns = layout.size[0], rows = layout.size[1];
  from_ = layout.from;
  cell_ = layout.cell;
  const stream::Channel& channel = store.schema().coordinates[2];
  std::vector<double> sum(columns * rows), weight(columns * rows);
  for_each_wanted(
      store, layout.detail,
      [&](stream::ClusterId, const stream::ClusterRecord&, const stream::ClusterPoints& points) {
        for (const stream::Point3& p : points.positions) {
          if (!std::isfinite(p[2])) continue;
          const std::array<double, 2> at = in_cells({p[0], p[1]});
          const std::size_t cell = cell_at(at[1], rows) * columns + cell_at(at[0], columns);
          sum[cell] += p[2] * channel.scale + channel.offset;
          weight[cell] += 1.0;
        }
      });
  if (std::all_of(weight.begin(), weight.end(), [](double w) { return w == 0.0; })) {
    throw stream::Error({.file = store.path().string(),
                         .where = {},
                         .cause = raster ? "no sample has data, so nothing can be filled"
                                         : "no point has a height, so there is nothing to tile",
                         .remedy = raster ? "look at the source's nodata value"
                                          : "look at the source's third coordinate"});
  }
  grid_.emplace(columns, rows, std::move(sum), std::move(weight));
}

double StoreFill::height(double x, double y) const {
  const std::array<double, 2> at = in_cells({x, y});
  return grid_->height(at[0], at[1]);
}

std::uint64_t StoreFill::digest(const StoredBox& box) const {
  return grid_->digest(in_cells(box.min), in_cells(box.max));
}

}  // namespace terrace::terrain
