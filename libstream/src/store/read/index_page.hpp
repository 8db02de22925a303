// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "store/codec/layout.hpp"
#include "store/codec/tables.hpp"

namespace terrace::stream::store {

/// Returns the maximum bytes of a page of thirteen columns and two for each attribute. A column has
/// a shift and a number per cluster, each of at most 81 bits. The rest is for two varints, the
/// states of two strings of symbols and a checksum.
constexpr std::uint64_t max_page_bytes(std::size_t attributes) {
  return 32 + (13 + 2 * std::uint64_t{attributes}) * 11 * (1 + kMaxPageClusters);
}

/// Columns of unsigned integers, one number per cluster.
class NumberColumns {
 public:
  /// clusters: 1 to kMaxPageClusters.
  NumberColumns(std::uint32_t clusters, std::size_t columns)
      : clusters_(clusters), values_(columns * clusters) {}

  [[nodiscard]] std::uint32_t clusters() const { return clusters_; }
  [[nodiscard]] std::size_t columns() const { return values_.size() / clusters_; }
  [[nodiscard]] std::span<std::uint64_t> column(std::size_t number) {
    return std::span(values_).subspan(number * clusters_, clusters_);
  }
  [[nodiscard]] std::span<const std::uint64_t> column(std::size_t number) const {
    return std::span(values_).subspan(number * clusters_, clusters_);
  }

 private:
  std::uint32_t clusters_;
  std::vector<std::uint64_t> values_;  ///< column after column
};

/// The fields of a page's entries.
struct PageColumns : NumberColumns {
  enum Field : unsigned {
    kSizeX,
    kSizeY,
    kSizeZ,
    kLowX,  ///< signed
    kLowY,
    kLowZ,
    kBytes,
    kPoints,
    kError,
    kDescendants,
    kForms,
    kJump,  ///< signed
    kChecksum,
    kFields
  };

  explicit PageColumns(std::uint32_t of_clusters) : NumberColumns(of_clusters, kFields) {}
  explicit PageColumns(std::span<const Entry> entries);
};

/// The ranges of a page's clusters, with a column for each end of each attribute's range.
struct RangeColumns : NumberColumns {
  RangeColumns(std::uint32_t of_clusters, std::size_t attributes)
      : NumberColumns(of_clusters, 2 * attributes) {}
  /// ranges: cluster by cluster, then attribute by attribute; they are widened so that few bits
  /// represent them.
  RangeColumns(std::span<const KeyRange> ranges, std::span<const ScalarType> types);

  /// Returns the range of an attribute in cluster i.
  [[nodiscard]] KeyRange range(std::uint32_t i, std::size_t attribute) const {
    return {column(2 * attribute)[i], column(2 * attribute + 1)[i]};
  }
};

/// The contents of a page.
struct PageContent {
  std::uint64_t offset = 0;  ///< offset of the first cluster in the level's data file
  PageColumns entries;
  RangeColumns ranges;

  /// Adds the symbols to `counts`, by context of `layout`.
  void count(const Layout& layout, std::span<std::array<std::uint32_t, kSymbols>> counts);
  /// Appends a page.
  void write(const Layout& layout, const EncodingTables& tables, Bytes& out);
};

/// A page whose ranges are still coded, because few readers need them.
struct CodedPage {
  std::uint64_t offset = 0;  ///< see PageContent
  PageColumns entries;
  Bytes ranges;  ///< padded
};

/// Decodes a page. bytes: as in the file, including the checksum. tables: the first cluster's.
/// Throws: Damage.
CodedPage read_page(ByteView bytes, std::uint32_t clusters, const Layout& layout,
                    const DecodingTables& tables);
/// Throws: Damage.
RangeColumns read_ranges(const Bytes& coded, std::uint32_t clusters, const Layout& layout,
                         const DecodingTables& tables);

/// A page that has been checked, with random access to its entries.
class IndexPage {
 public:
  /// See read_page(). Throws: Damage.
  IndexPage(ByteView bytes, std::uint32_t clusters, const Layout& layout,
            const DecodingTables& tables);

  [[nodiscard]] std::uint32_t clusters() const { return clusters_; }
  [[nodiscard]] Entry entry(std::uint32_t i) const;
  /// Decodes the ranges, which may be widened. layout, tables: the page's. Throws: Damage.
  [[nodiscard]] RangeColumns ranges(const Layout& layout, const DecodingTables& tables) const {
    return read_ranges(ranges_, clusters_, layout, tables);
  }
  /// Where the bytes of cluster i begin in the data file; end() is where they end.
  [[nodiscard]] std::uint64_t offset(std::uint32_t i) const { return value(kOffset, i); }
  [[nodiscard]] std::uint64_t end(std::uint32_t i) const {
    return offset(i) + value(Field::kBytes, i);
  }

 private:
  using Field = PageColumns::Field;
  /// Offsets replace the jumps.
  static constexpr Field kOffset = Field::kJump;
  /// Values above a base, in as few bytes as the largest needs.
  struct Column {
    std::uint64_t base = 0, mask = 0;  ///< mask: the bits stored in bytes_
    std::uint32_t start = 0;           ///< position of the first value in bytes_
    std::uint8_t shift = 0, width = 0;
  };

  [[nodiscard]] std::uint64_t value(Field field, std::uint32_t i) const;
  void keep(const PageColumns& columns);

  std::uint32_t clusters_ = 0;
  std::array<Column, Field::kFields> columns_;
  Bytes bytes_;   ///< followed by eight more, so that a value is one load
  Bytes ranges_;  ///< see CodedPage
};

}  // namespace terrace::stream::store
