// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "store/codec/layout.hpp"

namespace terrace::stream::store {

/// Clusters in a page, the last of a level excepted. A page's ordinals follow by arithmetic.
inline constexpr std::uint32_t kPageClusters = 128;
/// More bytes than this no page has: twelve columns, each with its base, shift and width, of 64
/// bits a cluster.
inline constexpr std::uint64_t kMostPageBytes = 10 + 12 * (10 + 2 + 8 * kPageClusters) + 4;

/// Appends the page of `entries` (1 to kPageClusters): packed columns, each a base, a shift and a
/// width, then as many bits per cluster as the width says; and the CRC-32 of it all.
/// offset: of the first cluster in the level's data file.
void write_page(std::span<const Entry> entries, std::uint64_t offset, Bytes& out);

/// A page as it lies in the file, checked, with any entry at hand.
class IndexPage {
 public:
  /// Throws: Damage.
  IndexPage(Bytes bytes, std::uint32_t clusters);

  [[nodiscard]] std::uint32_t clusters() const { return clusters_; }
  [[nodiscard]] Entry entry(std::uint32_t i) const;
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

  [[nodiscard]] std::uint64_t value(Field field, std::uint32_t i) const;
  friend void write_page(std::span<const Entry>, std::uint64_t, Bytes&);
  static std::array<std::uint64_t, kFields> fields_of(const Entry& entry);

  Bytes bytes_;
  std::uint32_t clusters_ = 0;
  std::array<std::uint64_t, kPageClusters + 1> offsets_{};
  std::array<Column, kFields> columns_{};
};

}  // namespace terrace::stream::store
