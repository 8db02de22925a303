// SPDX-License-Identifier: Apache-2.0
#include "surface/store_fill.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>

#include "base/digest.hpp"
#include "terrace/terrain/detail.hpp"

namespace terrace::terrain {
namespace {

// Sums of heights and their weights; a mean exists where the weight is not 0.
struct Sums {
  std::size_t columns = 0, rows = 0;
  std::vector<double> sum, weight;
};

Sums halved(const Sums& fine) {
  Sums coarse{
      .columns = (fine.columns + 1) / 2, .rows = (fine.rows + 1) / 2, .sum = {}, .weight = {}};
  coarse.sum.resize(coarse.columns * coarse.rows);
  coarse.weight.resize(coarse.columns * coarse.rows);
  for (std::size_t row = 0; row < fine.rows; ++row) {
    for (std::size_t column = 0; column < fine.columns; ++column) {
      const std::size_t from = row * fine.columns + column;
      if (fine.weight[from] == 0.0) continue;
      // Every cell with data counts once, regardless of its weight, so that near heights dominate.
      const std::size_t to = row / 2 * coarse.columns + column / 2;
      coarse.sum[to] += fine.sum[from] / fine.weight[from];
      coarse.weight[to] += 1.0;
    }
  }
  return coarse;
}

double between(const std::vector<float>& heights, std::size_t columns, std::size_t rows, double x,
               double y) {
  const double cx = std::clamp(x - 0.5, 0.0, static_cast<double>(columns - 1));
  const double cy = std::clamp(y - 0.5, 0.0, static_cast<double>(rows - 1));
  const auto c0 = static_cast<std::size_t>(cx), r0 = static_cast<std::size_t>(cy);
  const std::size_t c1 = std::min(c0 + 1, columns - 1), r1 = std::min(r0 + 1, rows - 1);
  const double fx = cx - static_cast<double>(c0), fy = cy - static_cast<double>(r0);
  const auto at = [&](std::size_t c, std::size_t r) {
    return static_cast<double>(heights[r * columns + c]);
  };
  return (1.0 - fy) * ((1.0 - fx) * at(c0, r0) + fx * at(c1, r0)) +
         fy * ((1.0 - fx) * at(c0, r1) + fx * at(c1, r1));
}

constexpr std::uint64_t kMaxCells = std::uint64_t{1} << 20;
constexpr std::uint64_t kMaxPoints = std::uint64_t{1} << 23;

/// The level to read, and the grid of means.
struct Layout {
  Detail detail;
  std::array<double, 2> from{}, cell{1.0, 1.0};
  std::array<std::size_t, 2> size{1, 1};
};

/// Squares of samples. The points of level 1 are dense enough for filling.
Layout of_raster(const stream::Store& store) {
  const std::array<std::uint64_t, 2> samples{store.schema().columns, store.schema().rows};
  std::uint64_t reduction = 1;
  const auto reduced = [&](std::size_t axis) {
    return (samples[axis] + reduction - 1) / reduction;
  };
  while (reduced(0) * reduced(1) > kMaxCells) ++reduction;
  Layout layout;
  layout.detail.level = std::min(1U, store.top());
  for (std::size_t axis = 0; axis < 2; ++axis) {
    layout.from[axis] = -0.5;
    layout.cell[axis] = static_cast<double>(reduction);
    layout.size[axis] = static_cast<std::size_t>(reduced(axis));
  }
  return layout;
}

/// The finest level that is not too large, and about one point per cell, so that the surface
/// matches the points at the border.
Layout of_points(const stream::Store& store) {
  Layout layout;
  unsigned& level = layout.detail.level;
  while (level < store.top() && store.levels()[level].points > kMaxPoints) ++level;
  const std::uint64_t points = store.levels()[level].points;
  const auto cells = static_cast<double>(std::clamp<std::uint64_t>(points, 1, kMaxCells));
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

/// Returns the cell of a place; the last cell is closed. NaN, which occurs for a box too large for
/// doubles, is in the last cell.
std::size_t cell_at(double place, std::size_t cells) {
  return place < static_cast<double>(cells - 1) ? static_cast<std::size_t>(place) : cells - 1;
}

}  // namespace

FilledGrid::FilledGrid(std::size_t columns, std::size_t rows, std::vector<double> sum,
                       std::vector<double> weight) {
  assert(sum.size() == columns * rows && weight.size() == columns * rows);
  assert(std::any_of(weight.begin(), weight.end(), [](double w) { return w > 0.0; }));
  std::vector<Sums> pyramid;
  pyramid.push_back({columns, rows, std::move(sum), std::move(weight)});
  while (pyramid.back().sum.size() > 1) pyramid.push_back(halved(pyramid.back()));
  for (auto level = pyramid.rbegin(); level != pyramid.rend(); ++level) {
    std::vector<float> finer(level->sum.size());
    for (std::size_t row = 0; row < level->rows; ++row) {
      for (std::size_t column = 0; column < level->columns; ++column) {
        const std::size_t cell = row * level->columns + column;
        finer[cell] = static_cast<float>(level->weight[cell] > 0.0
                                             ? level->sum[cell] / level->weight[cell]
                                             : between(heights_, columns_, rows_,
                                                       (static_cast<double>(column) + 0.5) / 2.0,
                                                       (static_cast<double>(row) + 0.5) / 2.0));
      }
    }
    columns_ = level->columns;
    rows_ = level->rows;
    heights_ = std::move(finer);
  }
}

double FilledGrid::height(double x, double y) const {
  return between(heights_, columns_, rows_, x, y);
}

std::uint64_t FilledGrid::digest(const std::array<double, 2>& first,
                                 const std::array<double, 2>& last) const {
  // The first and last cells that between() uses.
  const auto cells = [&](std::size_t axis, std::size_t number) {
    const auto cell = [number](double place) {
      return static_cast<std::size_t>(
          std::clamp(place - 0.5, 0.0, static_cast<double>(number - 1)));
    };
    return std::pair{cell(first[axis]), std::min(cell(last[axis]) + 1, number - 1)};
  };
  const auto [left, right] = cells(0, columns_);
  const auto [top, bottom] = cells(1, rows_);
  Digest digest;
  for (std::size_t row = top; row <= bottom; ++row) {
    for (std::size_t column = left; column <= right; ++column) {
      const std::size_t cell = row * columns_ + column;
      digest.add(std::uint64_t{cell});
      digest.add(static_cast<double>(heights_[cell]));
    }
  }
  return digest.value();
}

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
        for (std::size_t i = 0; i < points.size(); ++i) {
          const stream::Point3& p = points.positions[i];
          if (!points.match(i) || !std::isfinite(p[2])) continue;
          const std::array<double, 2> at = in_cells({p[0], p[1]});
          const std::size_t cell = cell_at(at[1], rows) * columns + cell_at(at[0], columns);
          sum[cell] += p[2] * channel.scale + channel.offset;
          weight[cell] += 1.0;
        }
      });
  if (std::all_of(weight.begin(), weight.end(), [](double w) { return w == 0.0; })) {
    throw stream::Error(store.path().string(),
                        raster ? "no sample has data, so nothing can be filled"
                               : "no point has a height, so there is nothing to tile")
        .remedy(raster ? "check the source's nodata value" : "check the source's third coordinate");
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
