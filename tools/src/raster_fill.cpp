// SPDX-License-Identifier: GPL-3.0-or-later
#include "raster_fill.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <terrace/stream/error.hpp>

#include "detail.hpp"
#include "digest.hpp"
#include "interrupt.hpp"

namespace terrace::tools {
namespace {

constexpr std::size_t kMostCells = std::size_t{1} << 20;

// Sums of heights and their weights; a mean where the weight is not 0.
struct Sums {
  std::size_t columns = 0, rows = 0;
  std::vector<double> sum, weight;

  Sums(std::size_t c, std::size_t r) : columns(c), rows(r), sum(c * r), weight(c * r) {}
};

Sums halved(const Sums& fine) {
  Sums coarse((fine.columns + 1) / 2, (fine.rows + 1) / 2);
  for (std::size_t row = 0; row < fine.rows; ++row) {
    for (std::size_t column = 0; column < fine.columns; ++column) {
      const std::size_t from = row * fine.columns + column;
      if (fine.weight[from] == 0.0) continue;
      // Every cell with data counts once, however much it holds: near heights weigh more then.
      const std::size_t to = row / 2 * coarse.columns + column / 2;
      coarse.sum[to] += fine.sum[from] / fine.weight[from];
      coarse.weight[to] += 1.0;
    }
  }
  return coarse;
}

// Bilinear between the centres of cells; x, y in cells, the first cell's centre at 0.5.
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

}  // namespace

RasterFill::RasterFill(const stream::Store& store) {
  const stream::Schema& schema = store.schema();
  std::size_t reduction = 1;
  const auto reduced = [&](std::uint64_t count) {
    return (static_cast<std::size_t>(count) + reduction - 1) / reduction;
  };
  while (reduced(schema.columns) * reduced(schema.rows) > kMostCells) ++reduction;
  reduction_ = static_cast<double>(reduction);

  // The points of level 1 lie close enough for a surface that nothing measures.
  Sums finest(reduced(schema.columns), reduced(schema.rows));
  Detail detail;
  detail.level = std::min(1U, store.top());
  const stream::Channel& channel = schema.coordinates[2];
  for_each_wanted(
      store, detail,
      [&](stream::ClusterId, const stream::ClusterRecord&, const stream::ClusterPoints& points) {
        check_interrupt();
        for (const stream::Point3& p : points.positions) {
          const auto column = static_cast<std::size_t>(p[0]) / reduction;
          const auto row = static_cast<std::size_t>(p[1]) / reduction;
          const std::size_t cell = row * finest.columns + column;
          finest.sum[cell] += p[2] * channel.scale + channel.offset;
          finest.weight[cell] += 1.0;
        }
      });

  std::vector<Sums> pyramid{std::move(finest)};
  while (pyramid.back().sum.size() > 1) pyramid.push_back(halved(pyramid.back()));
  if (pyramid.back().weight[0] == 0.0) {
    throw stream::Error({.file = store.path().string(),
                         .where = {},
                         .cause = "no sample has data, so nothing can be filled",
                         .remedy = "look at the source's nodata value"});
  }
  Grid grid;
  for (auto level = pyramid.rbegin(); level != pyramid.rend(); ++level) {
    Grid finer{level->columns, level->rows, std::vector<float>(level->sum.size())};
    for (std::size_t row = 0; row < finer.rows; ++row) {
      for (std::size_t column = 0; column < finer.columns; ++column) {
        const std::size_t cell = row * finer.columns + column;
        finer.heights[cell] = static_cast<float>(
            level->weight[cell] > 0.0 ? level->sum[cell] / level->weight[cell]
                                      : between(grid.heights, grid.columns, grid.rows,
                                                (static_cast<double>(column) + 0.5) / 2.0,
                                                (static_cast<double>(row) + 0.5) / 2.0));
      }
    }
    grid = std::move(finer);
  }
  grid_ = std::move(grid);
}

double RasterFill::height(double column, double row) const {
  return between(grid_.heights, grid_.columns, grid_.rows, (column + 0.5) / reduction_,
                 (row + 0.5) / reduction_);
}

std::uint64_t RasterFill::digest(const LatticeWindow& window) const {
  Digest digest;
  if (window.columns <= 0 || window.rows <= 0) return digest.value();
  // The first and the last cell that between() takes.
  const auto cells = [this](std::int64_t first, std::int64_t count, std::size_t number) {
    const auto cell = [&](std::int64_t place) {
      const double at = (static_cast<double>(place) + 0.5) / reduction_ - 0.5;
      return static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(number - 1)));
    };
    return std::pair{cell(first), std::min(cell(first + count - 1) + 1, number - 1)};
  };
  const auto [left, right] = cells(window.column, window.columns, grid_.columns);
  const auto [top, bottom] = cells(window.row, window.rows, grid_.rows);
  for (std::size_t row = top; row <= bottom; ++row) {
    for (std::size_t column = left; column <= right; ++column) {
      const std::size_t cell = row * grid_.columns + column;
      digest.add(std::uint64_t{cell});
      digest.add(static_cast<double>(grid_.heights[cell]));
    }
  }
  return digest.value();
}

}  // namespace terrace::tools
