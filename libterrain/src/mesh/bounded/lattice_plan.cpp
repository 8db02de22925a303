// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/lattice_plan.hpp"

#include <algorithm>
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

}  // namespace terrace::terrain
