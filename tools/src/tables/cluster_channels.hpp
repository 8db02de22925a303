// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "tables/point_table.hpp"

namespace terrace::tools {

/// Columns that count in distances.
struct ChannelTable {
  std::vector<double> values;   ///< by point, then column
  std::vector<double> weights;  ///< metres of a unit, by column
};

/// options: "NAME:WEIGHT" of columns. Throws: UsageError; what PointTable::column() throws.
ChannelTable read_channels(const PointTable& table, const std::vector<std::string>& options);

}  // namespace terrace::tools
