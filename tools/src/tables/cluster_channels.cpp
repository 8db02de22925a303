// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/cluster_channels.hpp"

#include <cstddef>

#include "base/units.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;

ChannelTable read_channels(const PointTable& table, const std::vector<std::string>& options) {
  ChannelTable channels;
  std::vector<std::vector<double>> columns;
  for (const std::string& text : options) {
    const std::size_t colon = text.rfind(':');
    if (colon == std::string::npos || colon == 0) {
      throw UsageError("--channel " + text + ": write NAME:WEIGHT, as in intensity:0.5");
    }
    channels.weights.push_back(
        parse_number(text.substr(colon + 1), "the weight of --channel " + text));
    if (!(channels.weights.back() >= 0)) {
      throw UsageError("--channel " + text + ": the weight must not be negative");
    }
    columns.push_back(table.column(text.substr(0, colon)));
  }
  channels.values.resize(table.size() * columns.size());
  for (std::size_t c = 0; c < columns.size(); ++c) {
    for (std::size_t i = 0; i < table.size(); ++i) {
      channels.values[i * columns.size() + c] = columns[c][i];
    }
  }
  return channels;
}

}  // namespace terrace::tools
