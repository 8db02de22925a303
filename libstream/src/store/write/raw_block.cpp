// SPDX-License-Identifier: Apache-2.0
#include "store/write/raw_block.hpp"

#include <numeric>

namespace terrace::stream::store {

RawBlock::RawBlock(const ClusteredBlock& block)
    : level(block.level),
      positions(block.positions.begin(), block.positions.end()),
      payload(block.payload.begin(), block.payload.end()),
      children(block.children.begin(), block.children.end()),
      first(block.first.begin(), block.first.end()),
      order(block.order.begin(), block.order.end()),
      representatives(block.representatives.begin(), block.representatives.end()),
      summaries(block.summaries.begin(), block.summaries.end()) {}

void RawBlock::add(const ClusterPoints& cluster) {
  if (first.empty()) first.push_back(0);
  const auto at = std::ptrdiff_t{first.back()} + cluster.before_representative;
  positions.insert(positions.end(), cluster.positions.begin(), cluster.positions.end());
  payload.insert(payload.end(), cluster.payload.begin(), cluster.payload.end());
  children.insert(children.end(), cluster.children.begin(), cluster.children.end());
  if (cluster.has_representative) {
    representatives.push_back(static_cast<std::uint32_t>(at));
    positions.insert(positions.begin() + at, cluster.representative);
    const auto insert = [at](auto& all, const auto& added) {
      all.insert(all.begin() + at * static_cast<std::ptrdiff_t>(added.size()), added.begin(),
                 added.end());
    };
    insert(payload, cluster.representative_payload);
    insert(children, cluster.representative_children);
  } else {
    representatives.push_back(kNoRepresentative);
  }
  first.push_back(static_cast<std::uint32_t>(positions.size()));
  order.resize(positions.size());
  std::iota(order.begin() + first[first.size() - 2], order.end(), first[first.size() - 2]);
}

ClusteredBlock RawBlock::view() const {
  return {.level = level,
          .positions = positions,
          .payload = payload,
          .children = children,
          .first = first,
          .order = order,
          .representatives = representatives,
          .summaries = summaries};
}

RawBlock decoded_block(const Layout& layout, const Tables& tables, const Bytes& bytes,
                       std::span<const Entry> entries, std::vector<ClusterSummary> summaries,
                       bool root) {
  const DecodingTables decoding(tables);
  Bytes padded(kPadding, 0);
  padded.insert(padded.end(), bytes.begin(), bytes.end());
  padded.resize(padded.size() + kPadding);

  RawBlock block;
  block.level = layout.level;
  block.summaries = std::move(summaries);
  ClusterDecoder decoder;
  ClusterPoints points;
  std::size_t offset = kPadding;
  for (const Entry& entry : entries) {
    decoder.decode(layout, decoding, entry, ByteView(padded).subspan(offset, entry.bytes), root,
                   points);
    offset += entry.bytes;
    block.add(points);
  }
  return block;
}

}  // namespace terrace::stream::store
