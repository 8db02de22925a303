// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/lattice_plan.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

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

LatticeWindow lattice_of(const stream::Store& store, const std::optional<Region>& region) {
  const stream::StoreSchema& schema = store.schema();
  assert(schema.grid);
  const auto columns = static_cast<std::int64_t>(schema.columns);
  const auto rows = static_cast<std::int64_t>(schema.rows);
  if (!region) return {0, 0, columns, rows};
  const stream::Placement& placement = schema;
  stream::Box3 box;
  for (unsigned corner = 0; corner < 4; ++corner) {
    const Point2 stored =
        stored_place(placement, {((corner & 1) != 0 ? region->box().max : region->box().min)[0],
                                 ((corner & 2) != 0 ? region->box().max : region->box().min)[1]});
    box.include(stream::Point3{stored[0], stored[1], 0.0});
  }
  const auto first = [](double low, std::int64_t count) {
    return static_cast<std::int64_t>(
        std::clamp(std::floor(low) - 1.0, 0.0, static_cast<double>(count)));
  };
  const auto last = [](double high, std::int64_t count) {
    return static_cast<std::int64_t>(
        std::clamp(std::ceil(high) + 1.0, -1.0, static_cast<double>(count - 1)));
  };
  const std::int64_t c0 = first(box.min[0], columns), c1 = last(box.max[0], columns);
  const std::int64_t r0 = first(box.min[1], rows), r1 = last(box.max[1], rows);
  // More than a sample outside: nothing of it is inside.
  const bool missed = box.empty() || box.max[0] < 0.0 || box.max[1] < 0.0 ||
                      box.min[0] > static_cast<double>(columns - 1) ||
                      box.min[1] > static_cast<double>(rows - 1) || c1 < c0 || r1 < r0;
  if (missed) return {};
  return {c0, r0, c1 - c0 + 1, r1 - r0 + 1};
}

LatticePlan::LatticePlan(const LatticeWindow& whole, std::int64_t cells)
    : whole_(whole),
      columns_(cut(whole.column, whole.columns, cells)),
      rows_(cut(whole.row, whole.rows, cells)) {
  assert(whole.columns > 0 && whole.rows > 0 && cells > 0);
}

LatticeWindow LatticePlan::window(std::size_t i) const {
  assert(i < size());
  const std::size_t x = i % across(), y = i / across();
  return {columns_[x], rows_[y], columns_[x + 1] - columns_[x] + 1, rows_[y + 1] - rows_[y] + 1};
}

}  // namespace terrace::terrain
