// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "store/codec/layout.hpp"
#include "store/codec/tables.hpp"
#include "store/read/cluster_decoder.hpp"

namespace terrace::stream::store {

/// A clustered block that owns its data.
struct RawBlock {
  unsigned level = 0;
  std::vector<Point3> positions;
  std::vector<std::byte> payload;
  std::vector<std::uint64_t> children;
  std::vector<std::uint32_t> first, order, representatives;
  std::vector<ClusterSummary> summaries;

  RawBlock() = default;
  explicit RawBlock(const ClusteredBlock& block);
  /// Adds a cluster without a summary. The representative is put back at its position in the order
  /// of coding, because only the order distinguishes points at one place.
  void add(const ClusterPoints& cluster);
  [[nodiscard]] ClusteredBlock view() const;
};

/// Returns the block that was encoded into `bytes` and `entries`. Encoding it gives the same bytes
/// as encoding the original. The boxes of entries may be enlarged, so the caller supplies the
/// summaries.
RawBlock decoded_block(const Layout& layout, const Tables& tables, const Bytes& bytes,
                       std::span<const Entry> entries, std::vector<ClusterSummary> summaries,
                       bool root);

}  // namespace terrace::stream::store
