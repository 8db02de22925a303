// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "store/codec/grid_codec.hpp"
#include "store/codec/layout.hpp"
#include "store/codec/tables.hpp"

namespace terrace::stream::store {

/// How clusters of points that lie on no grid are coded.
struct Columns {
  bool sequence = false;  ///< points in their order, coordinates as columns; else SplitCodec's
  std::span<const ColumnKind> kinds;
};

/// Encodes the clusters of a block, each into a byte string of its own. Keeps its memory between
/// blocks. One object per thread.
class BlockEncoder {
 public:
  /// Takes in a block, which must outlive the calls below.
  /// Throws: Error on a position that is not finite or a cluster of more than kMostPoints points.
  void load(const Layout& layout, const ClusteredBlock& block);

  /// Training: the loaded block enters the least squares ...
  void fit(PredictorFit& sums);
  /// ... and its symbols are counted. Returns the raw bits beside them.
  std::uint64_t count(const Predictor& predictor, const Columns& columns, Counts& counts);

  /// Appends the clusters' bytes, entries and, attribute by attribute, ranges.
  void encode(const EncodingTables& tables, bool sequence, Bytes& bytes,
              std::vector<Entry>& entries, std::vector<KeyRange>& ranges);

 private:
  void load_axis(std::size_t axis);
  void load_attributes();
  Entry enter(std::size_t cluster);
  [[nodiscard]] KeyRange range_of(std::size_t attribute) const;
  template <class Use>
  void positions(SymbolEncoder& coder, const Columns& columns, Use&& heights);
  void encode_cluster(SymbolEncoder& coder, const Predictor& predictor, const Columns& columns);

  const Layout* layout_ = nullptr;
  const ClusteredBlock* block_ = nullptr;
  // The block, as integers.
  std::array<NumberForm, 3> forms_{};
  std::array<unsigned, 3> shifts_{};
  std::array<std::vector<std::int64_t>, 3> axes_;
  std::vector<NumberForm> attribute_forms_;
  std::vector<std::vector<std::int64_t>> attributes_;
  // The present cluster.
  std::span<const std::uint32_t> members_;
  std::uint32_t representative_ = 0;
  IntegerBox coded_box_;  ///< within the entry's box
  IntegerBox entry_box_;
  bool own_box_ = false;
  std::array<std::vector<std::uint64_t>, 3> relative_;  ///< to coded_box_
  std::vector<std::uint32_t> order_;                    ///< of coding, as numbers within members_
  GridCodec grid_;
  SplitCodec split_;
  std::vector<std::int64_t> column_, beside_, scratch_;
  std::vector<double> doubles_;
};

}  // namespace terrace::stream::store
