// SPDX-License-Identifier: Apache-2.0
#include "surface/filled_grid.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "base/digest.hpp"

namespace terrace::terrain {
namespace {

// Sums of heights and their weights; a mean where the weight is not 0.
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
      // Every cell with data counts once, however much it holds: near heights weigh more then.
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
  // The first and the last cell that between() takes.
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

}  // namespace terrace::terrain
