// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "store/codec/layout.hpp"

namespace terrace::stream::store {

/// Clusters in a page, the last of a level excepted. A page's ordinals follow by arithmetic.
inline constexpr std::uint32_t kPageClusters = 128;
/// More bytes than this no page has: twelve columns and two for each attribute, each with its base,
/// shift and width, of 64 bits a cluster.
constexpr std::uint64_t most_page_bytes(std::size_t attributes) {
  return 10 + (12 + 2 * std::uint64_t{attributes}) * (10 + 2 + 8 * kPageClusters) + 4;
}

/// Appends the page of `entries` (1 to kPageClusters): packed columns, each a base, a shift and a
/// width, then as many bits per cluster as the width says; and the CRC-32 of it all.
/// types: of the attributes that have ranges. ranges: of each entry, attribute by attribute; they
/// are widened to a few bits. offset: of the first cluster in the level's data file.
void write_page(std::span<const Entry> entries, std::span<const ScalarType> types,
                std::span<const KeyRange> ranges, std::uint64_t offset, Bytes& out);

/// A page as it lies in the file, checked, with any entry at hand.
class IndexPage {
 public:
  /// attributes: so many have ranges. Throws: Damage.
  IndexPage(Bytes bytes, std::uint32_t clusters, std::size_t attributes);

  [[nodiscard]] std::uint32_t clusters() const { return clusters_; }
  [[nodiscard]] Entry entry(std::uint32_t i) const;
  /// Of an attribute in cluster i, perhaps wider than it is. Requires ranges.
  [[nodiscard]] KeyRange range(std::uint32_t i, std::size_t attribute) const;
  /// Offset of cluster i in the data file; i = clusters() is behind the last.
  [[nodiscard]] std::uint64_t offset(std::uint32_t i) const { return offsets_[i]; }
  /// Offset of the cluster behind the last.
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

  /// Of a column, above its base.
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
