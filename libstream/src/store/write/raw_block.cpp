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

ClusteredBlock RawBlock::view() const {
  return {level, positions, payload, children, first, order, representatives, summaries};
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
  block.first.push_back(0);
  ClusterDecoder decoder;
  ClusterPoints points;
  std::size_t offset = kPadding;
  for (const Entry& entry : entries) {
    decoder.decode(layout, decoding, entry, ByteView(padded).subspan(offset, entry.bytes), root,
                   points);
    offset += entry.bytes;
    // The representative goes back to its place in the order of coding: among points at one
    // position, order is what tells them apart.
    const auto start = static_cast<std::uint32_t>(block.positions.size());
    block.positions.insert(block.positions.end(), points.positions.begin(), points.positions.end());
    block.payload.insert(block.payload.end(), points.payload.begin(), points.payload.end());
    block.children.insert(block.children.end(), points.children.begin(), points.children.end());
    if (points.has_representative) {
      const auto at = std::ptrdiff_t{start} + decoder.representative();
      block.representatives.push_back(static_cast<std::uint32_t>(at));
      block.positions.insert(block.positions.begin() + at, points.representative);
      block.payload.insert(
          block.payload.begin() + at * static_cast<std::ptrdiff_t>(layout.payload_size),
          points.representative_payload.begin(), points.representative_payload.end());
      block.children.insert(block.children.begin() + at * static_cast<std::ptrdiff_t>(layout.level),
                            points.representative_children.begin(),
                            points.representative_children.end());
    } else {
      block.representatives.push_back(UINT32_MAX);
    }
    block.first.push_back(static_cast<std::uint32_t>(block.positions.size()));
  }
  block.order.resize(block.positions.size());
  std::iota(block.order.begin(), block.order.end(), 0u);
  return block;
}

}  // namespace terrace::stream::store
