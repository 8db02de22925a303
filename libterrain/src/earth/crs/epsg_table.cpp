// SPDX-License-Identifier: GPL-3.0-or-later
#include "earth/crs/epsg_table.hpp"

#include <algorithm>
#include <cassert>

namespace terrace::terrain {
namespace {

template <class Row>
const Row* row_of(std::span<const Row> rows, int code) {
  const auto found = std::lower_bound(rows.begin(), rows.end(), code,
                                      [](const Row& row, int wanted) { return row.code < wanted; });
  return found != rows.end() && found->code == code ? &*found : nullptr;
}

}  // namespace

const EpsgGeographic* epsg_geographic(int code) { return row_of(epsg_tables().geographic, code); }

const EpsgConversion* epsg_conversion(int code) { return row_of(epsg_tables().conversions, code); }

const EpsgProjected* epsg_projected(int code) { return row_of(epsg_tables().projected, code); }

const EpsgVertical* epsg_vertical(int code) { return row_of(epsg_tables().vertical, code); }

const EpsgCompound* epsg_compound(int code) { return row_of(epsg_tables().compound, code); }

std::string name_of(const EpsgProjected& row) {
  if (row.name != nullptr) return row.name;
  const EpsgGeographic* const base = epsg_geographic(row.base);
  const EpsgConversion* const conversion = epsg_conversion(row.conversion);
  assert(base != nullptr && conversion != nullptr);
  return std::string(base->name) + " / " + conversion->name;
}

}  // namespace terrace::terrain
