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

/// How clusters of points other than rows of a raster are coded.
struct Columns {
  bool sequence = false;  ///< points keep their order, with coordinates as columns; otherwise split
  Guide guide;
  std::span<const ColumnKind> kinds;
};

/// The symbols of columns, each coded in several kinds.
struct KindCounts {
  std::vector<std::vector<ColumnKind>> kinds;  ///< to be tried, by column
  std::array<Counts, kColumnKinds> counts;
};

/// Encodes the clusters of a block, each into a separate byte string. Reuses its memory for the
/// next block. Not thread-safe.
class BlockEncoder {
 public:
  /// Loads a block, which must outlive the calls below. Throws: Error for a position that is not
  /// finite or a cluster of more than kMaxPoints points.
  void load(const Layout& layout, const ClusteredBlock& block);

  /// For training: adds the loaded block to the least squares.
  void fit(PredictorFit& sums);
  /// For training: counts the differences of an attribute within clusters, by bit width.
  void count_differences(unsigned attribute, std::array<std::uint64_t, 65>& widths);
  /// For training: counts the symbols. Returns the number of raw bits besides them.
  std::uint64_t count(const Predictor& predictor, const Columns& columns, Counts& counts);
  /// For training: counts the symbols of all kinds of columns to choose from.
  void count_kinds(const Predictor& predictor, bool sequence, const Guide& guide,
                   KindCounts& trials);

  /// Appends the clusters' bytes, their entries and their ranges, attribute by attribute.
  void encode(const EncodingTables& tables, bool sequence, Bytes& bytes,
              std::vector<Entry>& entries, std::vector<KeyRange>& ranges);

 private:
  /// An attribute of the block.
  struct Attribute {
    ScalarType type{};
    std::size_t offset = 0;  ///< in the payload of a point
    NumberForm form = kIntegerForm;
    bool one_value = false;  ///< whether all points of the block have `value`
    std::int64_t value = 0;
    std::vector<std::int64_t> numbers;  ///< by point, for floating-point types with several values
  };
  void load_axes();
  void load_decimals(std::size_t axis);
  void measure(std::size_t axis);
  void load_attributes();
  void load_numbers(Attribute& attribute);
  Entry enter(std::size_t cluster);
  void find_relative();
  /// Returns the representative's position in the order of coding, centred(); 0 without a
  /// representative.
  [[nodiscard]] std::uint32_t coded_representative(std::size_t cluster) const;
  void gather(const Attribute& attribute);
  /// Returns where to code the form; null for integers.
  static NumberForm* coded_form(Attribute& attribute);
  /// Codes the head and the positions of the points; returns false for a sequence, whose positions
  /// it does not code. On a grid calls `heights` for the rest. Sets order_.
  template <class Coder, class Use>
  bool positions(Coder& coder, const Columns& columns, Use&& heights);
  template <class Coder>
  void sequence(Coder& coder, const Columns& columns);
  /// Codes the current cluster. Sets ranges_ to the ranges of its attributes.
  template <class Coder>
  void encode_cluster(Coder& coder, const Predictor& predictor, const Columns& columns);

  const Layout* layout_ = nullptr;
  const ClusteredBlock* block_ = nullptr;
  // The block, as integers.
  std::array<NumberForm, 3> forms_{};
  std::array<unsigned, 3> shifts_{};
  std::array<std::vector<std::int64_t>, 3> axes_;  ///< in the order of the block, by cluster
  std::array<std::vector<Extent>, 3> extents_;     ///< extents of the clusters
  std::vector<Attribute> attributes_;
  std::vector<std::byte> differing_;
  // The current cluster.
  std::uint32_t first_ = 0;  ///< in the order of the block
  std::span<const std::uint32_t> members_;
  IntegerBox coded_box_;  ///< inside the entry's box
  IntegerBox entry_box_;
  std::array<std::uint64_t, 3> origin_{};  ///< origin of coded_box_
  bool own_box_ = false;
  std::array<std::vector<std::uint64_t>, 3> relative_;  ///< relative to origin_
  std::vector<std::uint32_t> order_;                    ///< order of coding, as indices of members_
  std::vector<std::uint32_t> coded_;                    ///< the points in that order
  std::vector<KeyRange> ranges_;
  GridCodec grid_;
  SplitEncoder split_;
  Lines lines_;
  std::vector<std::int64_t> column_, preceding_, guide_;
  ColumnScratch scratch_;
  std::vector<double> doubles_;
};

}  // namespace terrace::stream::store
