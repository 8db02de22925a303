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

void write_clustered(const std::string& path, const std::string& format, const PointTable& table,
                     const ClusterOutcome& outcome, bool replace) {
  // Points that were clustered before are clustered anew.
  struct Kept {
    std::size_t offset = 0, size = 0;
  };
  std::vector<stream::Channel> attributes;
  std::vector<Kept> kept;
  for (std::size_t c = 0; c < table.info.attributes.size(); ++c) {
    const stream::Channel& channel = table.info.attributes[c];
    if (channel.name == "cluster" || channel.name == "representative") continue;
    attributes.push_back(channel);
    kept.push_back({table.info.attribute_offset(c), stream::size_of(channel.type)});
  }
  attributes.push_back({.name = "cluster", .type = stream::ScalarType::i32});
  attributes.push_back({.name = "representative", .type = stream::ScalarType::i32});
  const auto writer =
      stream::open_point_writer(path,
                                {.attributes = std::move(attributes),
                                 .comments = {kWriterMark},
                                 .crs = crs_to_write(table.info.crs),
                                 .lattice = lattice_of(table.info)},
                                {.format = format, .replace = replace, .stop = stop_token()});
  constexpr std::size_t kBlock = 65536;
  const std::size_t record_bytes = table.info.payload_size();
  stream::PointBlock block;
  for (std::size_t begin = 0; begin < table.size(); begin += kBlock) {
    check_interrupt();
    const std::size_t end = std::min(begin + kBlock, table.size());
    block.clear();
    for (std::size_t i = begin; i < end; ++i) {
      block.positions.push_back(table.positions[i]);
      const std::byte* const record = table.payload.data() + i * record_bytes;
      for (const Kept& part : kept) {
        block.payload.insert(block.payload.end(), record + part.offset,
                             record + part.offset + part.size);
      }
      const std::uint32_t cluster = outcome.labels[i];
      const bool outlier = cluster == cluster::kOutlier;
      const std::array<std::int32_t, 2> labels{
          outlier ? -1 : static_cast<std::int32_t>(cluster),
          outlier ? -1 : static_cast<std::int32_t>(outcome.representatives[cluster])};
      const auto bytes = std::as_bytes(std::span(labels));
      block.payload.insert(block.payload.end(), bytes.begin(), bytes.end());
    }
    writer->append(block);
  }
  writer->finish();
}

}  // namespace terrace::tools
