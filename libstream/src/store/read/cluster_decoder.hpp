// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "store/codec/column.hpp"
#include "store/codec/grid.hpp"
#include "store/codec/layout.hpp"
#include "store/codec/tables.hpp"

namespace terrace::stream::store {

/// Decodes clusters. Reuses its memory from one to the next. Not thread-safe.
class ClusterDecoder {
 public:
  /// Decodes a cluster. bytes: entry.bytes of them, with kPadding readable bytes before and after.
  /// root: no point is the representative.
  /// Throws: Damage if the bytes are not a cluster of entry.points points in the entry's box.
  void decode(const Layout& layout, const DecodingTables& tables, const Entry& entry,
              ByteView bytes, bool root, ClusterPoints& out);

 private:
  /// Decodes the positions. False if the points are in a sequence, whose coordinates follow as
  /// columns.
  bool positions(SymbolDecoder& coder, const Layout& layout, const DecodingTables& tables,
                 const Entry& entry);
  void sequence(SymbolDecoder& coder, const Layout& layout, const DecodingTables& tables,
                std::uint32_t n);
  /// Decodes an attribute into column_, or the guide into guide_.
  void attribute(SymbolDecoder& coder, const Layout& layout, const DecodingTables& tables,
                 unsigned number, std::uint32_t n);
  /// Deliver the points in the order of coding, except the representative, which has its own
  /// fields. representative: n if there is none.
  void deliver(const Entry& entry, std::uint32_t representative, ClusterPoints& out) const;
  void deliver_payload(std::size_t stride, std::uint32_t n, std::uint32_t representative,
                       ClusterPoints& out) const;
  void deliver_children(unsigned level, std::uint32_t n, std::uint32_t representative,
                        ClusterPoints& out) const;

  IntegerBox box_;
  std::array<std::vector<std::uint64_t>, 3> relative_;
  GridCodec grid_;
  SplitDecoder split_;
  std::vector<std::int64_t> column_, preceding_, guide_;
  Lines lines_;
  std::vector<std::byte> payload_;
  std::vector<std::int64_t> children_;
};

}  // namespace terrace::stream::store
