// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "store/codec/layout.hpp"
#include "store/codec/tables.hpp"

namespace terrace::stream::store {

/// A box around all points of a page's clusters and below them, which the directory has: in
/// 65535ths of the store's bounds.
struct PageBox {
  std::array<std::uint16_t, 3> low{UINT16_MAX, UINT16_MAX, UINT16_MAX}, high{};

  [[nodiscard]] Box3 in(const Box3& bounds) const;
  /// The least that holds what lies of `box` within `bounds`.
  static PageBox around(const Box3& box, const Box3& bounds);
};
inline constexpr std::uint64_t kPageBoxBytes = 12;

/// Maximum bytes of a page: twelve columns and two for each attribute. Before version 4 each has
/// its base, shift and width, and at most 64 bits per cluster; from then on its shift, and a number
/// takes at most 81 bits.
constexpr std::uint64_t most_page_bytes(std::size_t attributes) {
  return 18 + (12 + 2 * std::uint64_t{attributes}) * (10 + 2 + 11 * kMostPageClusters) + 4;
}

/// The columns of a page as unsigned integers: the fields of the entries, then the two ends of each
/// attribute's range.
class PageColumns {
 public:
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
    kChecksum,
    kFields
  };

  /// clusters: 1 to kMostPageClusters. attributes: those with ranges.
  PageColumns(std::uint32_t clusters, std::size_t attributes)
      : clusters_(clusters), values_((kFields + 2 * attributes) * clusters) {}
  /// ranges: for each entry, attribute by attribute; they are widened to a few bits.
  PageColumns(std::span<const Entry> entries, std::span<const ScalarType> types,
              std::span<const KeyRange> ranges);

  [[nodiscard]] std::uint32_t clusters() const { return clusters_; }
  [[nodiscard]] std::size_t columns() const { return values_.size() / clusters_; }
  [[nodiscard]] std::size_t attributes() const { return (columns() - kFields) / 2; }
  [[nodiscard]] std::span<std::uint64_t> column(std::size_t number) {
    return std::span(values_).subspan(number * clusters_, clusters_);
  }
  [[nodiscard]] std::span<const std::uint64_t> column(std::size_t number) const {
    return std::span(values_).subspan(number * clusters_, clusters_);
  }

  /// Adds the symbols of the columns to `counts`, by the contexts of `layout`.
  void count(const Layout& layout, std::span<std::array<std::uint32_t, kSymbols>> counts);
  /// Appends a page of version 4. offset: of the first cluster in the level's data file.
  void write(const Layout& layout, const EncodingTables& tables, std::uint64_t offset, Bytes& out);

 private:
  std::uint32_t clusters_;
  std::vector<std::uint64_t> values_;  ///< column after column
};

/// The columns of a page as it is in the file, checksum included. tables: those of its first
/// cluster, from version 4 on. offset: becomes that of the first cluster in the level's data file.
/// Throws: Damage.
PageColumns read_page(ByteView bytes, std::uint32_t clusters, const Layout& layout,
                      const DecodingTables* tables, std::uint64_t& offset);

/// A checked page, with random access to entries.
class IndexPage {
 public:
  /// See read_page(). Throws: Damage.
  IndexPage(ByteView bytes, std::uint32_t clusters, const Layout& layout,
            const DecodingTables* tables);

  [[nodiscard]] std::uint32_t clusters() const { return clusters_; }
  [[nodiscard]] Entry entry(std::uint32_t i) const;
  /// The range of an attribute in cluster i, possibly widened. Requires ranges.
  [[nodiscard]] KeyRange range(std::uint32_t i, std::size_t attribute) const;
  /// Offset of cluster i in the data file; i = clusters() is the end of the last.
  [[nodiscard]] std::uint64_t offset(std::uint32_t i) const { return offsets_[i]; }
  /// End of the last cluster.
  [[nodiscard]] std::uint64_t end() const { return offsets_[clusters_]; }

 private:
  using Field = PageColumns::Field;
  /// Values above a base, in as few bytes as the largest takes.
  struct Column {
    std::uint64_t base = 0, mask = 0;  ///< mask: the bits that are in bytes_
    std::uint32_t start = 0;           ///< of the first value, in bytes_
    std::uint8_t shift = 0, width = 0;
  };

  [[nodiscard]] std::uint64_t value(std::size_t column, std::uint32_t i) const;
  void keep(const PageColumns& columns);

  std::uint32_t clusters_ = 0;
  std::array<std::uint64_t, kMostPageClusters + 1> offsets_{};
  std::vector<Column> columns_;
  Bytes bytes_;  ///< and eight more, so that a value is one load
};

}  // namespace terrace::stream::store
