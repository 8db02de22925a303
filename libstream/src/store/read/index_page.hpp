// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "store/codec/layout.hpp"

namespace terrace::stream::store {

/// Clusters per page, except the last page of a level. A page's ordinals follow by arithmetic.
inline constexpr std::uint32_t kPageClusters = 128;
/// Maximum bytes of a page: twelve columns and two for each attribute, each with its base, shift
/// and width, and 64 bits per cluster.
constexpr std::uint64_t most_page_bytes(std::size_t attributes) {
  return 10 + (12 + 2 * std::uint64_t{attributes}) * (10 + 2 + 8 * kPageClusters) + 4;
}

/// Appends the page of `entries` (1 to kPageClusters): packed columns, each a base, a shift and a
/// width, then that many bits per cluster; and the CRC-32 of everything. types: of the attributes
/// that have ranges. ranges: for each entry, attribute by attribute; they are widened to a few
/// bits. offset: of the first cluster in the level's data file.
void write_page(std::span<const Entry> entries, std::span<const ScalarType> types,
                std::span<const KeyRange> ranges, std::uint64_t offset, Bytes& out);

/// A checked page in its file format, with random access to entries.
class IndexPage {
 public:
  /// attributes: number of attributes with ranges. Throws: Damage.
  IndexPage(Bytes bytes, std::uint32_t clusters, std::size_t attributes);

  [[nodiscard]] std::uint32_t clusters() const { return clusters_; }
  [[nodiscard]] Entry entry(std::uint32_t i) const;
  /// The range of an attribute in cluster i, possibly widened. Requires ranges.
  [[nodiscard]] KeyRange range(std::uint32_t i, std::size_t attribute) const;
  /// Offset of cluster i in the data file; i = clusters() is the end of the last.
  [[nodiscard]] std::uint64_t offset(std::uint32_t i) const { return offsets_[i]; }
  /// End of the last cluster.
  [[nodiscard]] std::uint64_t end() const { return offsets_[clusters_]; }

 private:
  enum Field : unsigned {
    kBytes,
    kPoints,
    kForms,
    kLowX,
    kLowY,
    kLowZ,
    kSizeX,
    kSizeY,
    kSizeZ,
    kError,
    kDescendants,
    kChecksum,
    kFields
  };
  struct Column {
    std::uint64_t base = 0;
    std::uint8_t shift = 0, width = 0;
    std::uint32_t start = 0;  ///< bit position of the first value
  };

  /// A value of a column, above its base.
  [[nodiscard]] std::uint64_t steps(std::size_t number, std::uint32_t i) const;
  [[nodiscard]] std::uint64_t value(std::size_t number, std::uint32_t i) const;
  friend void write_page(std::span<const Entry>, std::span<const ScalarType>,
                         std::span<const KeyRange>, std::uint64_t, Bytes&);
  static std::array<std::uint64_t, kFields> fields_of(const Entry& entry);

  Bytes bytes_;
  std::uint32_t clusters_ = 0;
  std::array<std::uint64_t, kPageClusters + 1> offsets_{};
  std::vector<Column> columns_;  ///< by Field, then low and high of each attribute
};

}  // namespace terrace::stream::store
