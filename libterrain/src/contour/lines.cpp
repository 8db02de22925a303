// SPDX-License-Identifier: Apache-2.0
#include "contour/lines.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <terrace/base/random.hpp>

#include "base/parallel.hpp"

namespace terrace::terrain {
namespace {

constexpr std::uint64_t kHorizontal = 0, kVerticalSide = 1, kFalling = 2, kRising = 3;

}  // namespace

ContourLines::ContourLines(std::int64_t columns, double interval,
                           std::function<void(ContourLine&&)> emit, OpenLineLimit limit,
                           unsigned threads)
    : columns_(columns),
      contour_levels_(interval),
      joiner_(std::move(emit), std::move(limit)),
      threads_(threads) {}

std::size_t ContourLines::Hash::operator()(const Crossing& c) const {
  return base::splitmix64(c.edge ^ base::splitmix64(static_cast<std::uint64_t>(c.level)));
}

ContourLines::Crossing ContourLines::crossing(std::int64_t level, const Corner& a,
                                              const Corner& b) const {
  const std::int64_t column = std::min(a.column, b.column), row = std::min(a.row, b.row);
  const std::uint64_t kind = a.row == b.row                             ? kHorizontal
                             : a.column == b.column                     ? kVerticalSide
                             : (a.column < b.column) == (a.row < b.row) ? kFalling
                                                                        : kRising;
  return {level, static_cast<std::uint64_t>(row * columns_ + column) * 4 + kind};
}

Point2 ContourLines::place(std::int64_t level, const Corner& a, const Corner& b) const {
  // Start at the same end in both triangles at an edge, so that they compute the same place.
  const bool first = std::pair(a.row, a.column) < std::pair(b.row, b.column);
  const Corner &from = first ? a : b, &to = first ? b : a;
  const double t = contour_levels_.share(level, from.height, to.height);
  return {static_cast<double>(from.column) + t * static_cast<double>(to.column - from.column),
          static_cast<double>(from.row) + t * static_cast<double>(to.row - from.row)};
}

void ContourLines::triangle(const Corner& a, const Corner& b, const Corner& c) {
  ContourLevels::cross(
      a, b, c,
      [&](std::int64_t level, const Corner& apex, const Corner& right, const Corner& left) {
        joiner_.add(crossing(level, apex, right), place(level, apex, right),
                    crossing(level, apex, left), place(level, apex, left));
      });
}

void ContourLines::emit_complete(std::int64_t last_row, bool all) {
  joiner_.emit_complete([&](const Crossing& c) {
    return !all && c.edge % 4 == kHorizontal &&
           c.edge / 4 / static_cast<std::uint64_t>(columns_) ==
               static_cast<std::uint64_t>(last_row);
  });
}

void ContourLines::find_crossed(std::span<const double> heights, std::int64_t rows) {
  const auto columns = static_cast<std::size_t>(columns_);
  levels_.resize(heights.size());
  parallel_for(static_cast<std::size_t>(rows), threads_, [&](std::size_t row) {
    for (std::size_t i = row * columns; i < (row + 1) * columns; ++i) {
      levels_[i] = std::isnan(heights[i]) ? 0 : contour_levels_.at_or_above(heights[i]);
    }
  });
  crossed_.resize(std::max(crossed_.size(), static_cast<std::size_t>(rows - 1)));
  parallel_for(static_cast<std::size_t>(rows - 1), threads_, [&](std::size_t row) {
    crossed_[row].clear();
    for (std::size_t column = 0; column + 1 < columns; ++column) {
      const std::size_t at = row * columns + column, below = at + columns;
      const std::int64_t level = levels_[at];
      if (levels_[at + 1] == level && levels_[below] == level && levels_[below + 1] == level) {
        continue;
      }
      crossed_[row].push_back(static_cast<std::uint32_t>(column));
    }
  });
}

void ContourLines::add(std::span<const double> heights, std::int64_t rows,
                       const std::function<bool(std::int64_t, std::int64_t)>& wanted) {
  find_crossed(heights, rows);
  const auto corner = [&](std::int64_t column, std::int64_t row) {
    const auto at = static_cast<std::size_t>(row * columns_ + column);
    return Corner{column, row_ + row, heights[at], levels_[at]};
  };
  for (std::int64_t row = 0; row + 1 < rows; ++row) {
    for (const std::uint32_t crossed : crossed_[static_cast<std::size_t>(row)]) {
      const std::int64_t column = crossed;
      if (wanted && !wanted(column, row_ + row)) continue;
      const Corner c00 = corner(column, row), c10 = corner(column + 1, row),
                   c01 = corner(column, row + 1), c11 = corner(column + 1, row + 1);
      const auto data = [](const Corner& c) { return !std::isnan(c.height); };
      // As in lattice_surface.hpp.
      if (data(c10) && data(c01)) {
        if (data(c00)) triangle(c00, c10, c01);
        if (data(c11)) triangle(c11, c01, c10);
      } else if (data(c00) && data(c11)) {
        if (data(c01)) triangle(c00, c11, c01);
        if (data(c10)) triangle(c00, c10, c11);
      }
    }
  }
  row_ += rows - 1;
  // Not after every band, because the order of lines must not depend on available memory.
  if (row_ % kMaxBandRows == 0) emit_complete(row_, false);
}

void ContourLines::finish() {
  emit_complete(row_, false);
  emit_complete(row_, true);
}

}  // namespace terrace::terrain
