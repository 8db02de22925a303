// SPDX-License-Identifier: Apache-2.0
#include "surface/bounded/lattice_plan.hpp"

#include <algorithm>
#include <array>
#include <cassert>

namespace terrace::terrain {
namespace {

std::vector<std::int64_t> cut(std::int64_t first, std::int64_t samples, std::int64_t cells) {
  const std::int64_t total = samples - 1;
  const std::int64_t parts = std::max<std::int64_t>(1, (total + cells / 2) / cells);
  std::vector<std::int64_t> sides;
  for (std::int64_t i = 0; i <= parts; ++i) sides.push_back(first + total * i / parts);
  return sides;
}

}  // namespace

LatticePlan::LatticePlan(const LatticeWindow& lattice, std::int64_t cells)
    : lattice_(lattice),
      columns_(cut(lattice.column, lattice.columns, cells)),
      rows_(cut(lattice.row, lattice.rows, cells)) {
  assert(lattice.columns > 0 && lattice.rows > 0 && cells > 0);
}

LatticeWindow LatticePlan::window(std::size_t i) const {
  assert(i < size());
  const std::size_t x = i % across(), y = i / across();
  return {columns_[x], rows_[y], columns_[x + 1] - columns_[x] + 1, rows_[y + 1] - rows_[y] + 1};
}

LatticePlan::Sample LatticePlan::sample(std::size_t i, std::int64_t column,
                                        std::int64_t row) const {
  const LatticeWindow window = this->window(i);
  const std::size_t x = i % across(), y = i / across();
  const bool west = column == 0 && x > 0, north = row == 0 && y > 0;
  const bool east = column + 1 == window.columns && x + 1 < across();
  const bool south = row + 1 == window.rows && y + 1 < down();
  Sample sample;
  sample.place = static_cast<std::uint64_t>((window.row + row - lattice_.row) * lattice_.columns +
                                            window.column + column - lattice_.column);
  sample.windows = (west || east ? 2U : 1U) * (north || south ? 2U : 1U);
  sample.last = (south ? y + 1 : y) * across() + (east ? x + 1 : x);
  return sample;
}

void LatticePlan::append_windows_at(const base::Point2& place,
                                    std::vector<std::uint32_t>& out) const {
  const auto range = [](const std::vector<std::int64_t>& sides, double at) {
    // The first side after the place, and the number of sides at it.
    const auto after = std::upper_bound(
        sides.begin(), sides.end(), at,
        [](double value, std::int64_t side) { return value < static_cast<double>(side); });
    const auto end = static_cast<std::size_t>(after - sides.begin());
    const bool is_outside = end == 0 || at > static_cast<double>(sides.back());
    if (is_outside || !(at == at)) return std::array<std::size_t, 2>{0, 0};
    const bool is_side = at == static_cast<double>(sides[end - 1]);
    const std::size_t first = is_side && end > 1 ? end - 2 : end - 1;
    return std::array<std::size_t, 2>{first, std::min(end, sides.size() - 1)};
  };
  const auto [first_column, end_column] = range(columns_, place[0]);
  const auto [first_row, end_row] = range(rows_, place[1]);
  for (std::size_t row = first_row; row < end_row; ++row) {
    for (std::size_t column = first_column; column < end_column; ++column) {
      out.push_back(static_cast<std::uint32_t>(row * across() + column));
    }
  }
}

}  // namespace terrace::terrain
