// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/cluster_channels.hpp"

#include <cstddef>

#include "cli/clustering_options.hpp"

namespace terrace::tools {

ChannelTable read_channels(const PointTable& table, const std::vector<std::string>& options) {
  ChannelTable channels;
  std::vector<std::vector<double>> columns;
  for (const std::string& text : options) {
    const auto& [name, weight] = channel_of(text);
    columns.push_back(table.column(name));
    channels.weights.push_back(weight);
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
