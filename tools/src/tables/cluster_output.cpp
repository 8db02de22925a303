// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/cluster_output.hpp"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "terrace/stream/point_writer.hpp"
#include "terrace/stream/sink.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;

void write_labels(const std::string& path, const ClusterOutcome& outcome, bool replace) {
  std::string text;
  for (const std::uint32_t label : outcome.labels) {
    text += label == cluster::kOutlier ? "-1" : std::to_string(label);
    text += '\n';
  }
  stream::Sink file(path, replace, stop_token());
  file.write(text);
  file.commit();
}

void write_clustered(const std::string& path, const std::string& format, PointTable table,
                     const ClusterOutcome& outcome, bool replace) {
  // Points that were clustered before are clustered anew.
  table.drop("cluster");
  table.drop("representative");
  std::vector<stream::Channel> attributes = table.info.attributes;
  attributes.push_back({.name = "cluster", .type = stream::ScalarType::i32});
  attributes.push_back({.name = "representative", .type = stream::ScalarType::i32});
  const auto writer = stream::open_point_writer(
      path, {.attributes = std::move(attributes), .comments = {kWriterMark}},
      {.format = format, .replace = replace, .stop = stop_token()});
  const std::size_t own = table.attributes.size();
  constexpr std::size_t kBlock = 65536;
  stream::PointBlock block;
  for (std::size_t begin = 0; begin < table.size(); begin += kBlock) {
    check_interrupt();
    const std::size_t end = std::min(begin + kBlock, table.size());
    const auto at = [](std::size_t i) { return static_cast<std::ptrdiff_t>(i); };
    block.positions.assign(table.positions.begin() + at(begin), table.positions.begin() + at(end));
    block.attributes.resize(own + 2);
    for (std::size_t c = 0; c < own; ++c) {
      const std::size_t size = stream::size_of(table.attributes[c].type);
      block.attributes[c].type = table.attributes[c].type;
      block.attributes[c].bytes.assign(table.attributes[c].bytes.begin() + at(begin * size),
                                       table.attributes[c].bytes.begin() + at(end * size));
    }
    std::vector<std::int32_t> label(end - begin), representative(end - begin);
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t cluster = outcome.labels[i];
      const bool outlier = cluster == cluster::kOutlier;
      label[i - begin] = outlier ? -1 : static_cast<std::int32_t>(cluster);
      representative[i - begin] =
          outlier ? -1 : static_cast<std::int32_t>(outcome.representatives[cluster]);
    }
    for (const auto& [slot, values] :
         {std::pair(own, &label), std::pair(own + 1, &representative)}) {
      const auto bytes = std::as_bytes(std::span<const std::int32_t>(*values));
      block.attributes[slot].type = stream::ScalarType::i32;
      block.attributes[slot].bytes.assign(bytes.begin(), bytes.end());
    }
    writer->append(block);
  }
  writer->finish();
}

}  // namespace terrace::tools
