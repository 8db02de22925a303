// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "store/codec/bytes.hpp"
#include "terrace/stream/overlay.hpp"

namespace terrace::stream::store {

inline constexpr char kOverlayMark[] = "terrace overlay\n";
inline constexpr std::size_t kOverlayMarkBytes = sizeof kOverlayMark - 1;
inline constexpr std::uint32_t kOverlayVersion = 1;
/// Bytes of the mark, version, checksum of the store, pages, offset of the directory, length of the
/// name.
inline constexpr std::size_t kOverlayHeadBytes = kOverlayMarkBytes + 4 + 4 + 8 + 8 + 4;
inline constexpr std::size_t kMaxOverlayNameBytes = 65535;
/// A page ends with the cluster that brings it to this many values.
inline constexpr std::size_t kOverlayPageValues = 4096;
/// Bytes of a page's entry in the directory: first cluster, offset, number of values.
inline constexpr std::size_t kOverlayEntryBytes = 8 + 8 + 4;

/// Returns the maximum bytes of a page of this many values, which it has if each is in a separate
/// cluster.
constexpr std::uint64_t max_overlay_page_bytes(std::uint64_t values) {
  return 4 + values * (10 + 5 + 5 + 8) + 4;
}

/// Some complete clusters of an overlay. Cluster clusters[c] has values[first[c]] ...
/// values[first[c + 1] - 1].
struct OverlayPage {
  std::vector<ClusterId> clusters;
  std::vector<std::size_t> first{0};  ///< one more than clusters
  std::vector<OverlayValue> values;

  /// Adds a value. `cluster` must not be below the last one, and the indices of a cluster must
  /// ascend.
  void add(ClusterId cluster, const OverlayValue& value);
  void clear();
  [[nodiscard]] std::span<const OverlayValue> of(std::size_t cluster) const {
    return std::span(values).subspan(first[cluster], first[cluster + 1] - first[cluster]);
  }

  friend bool operator==(const OverlayPage&, const OverlayPage&) = default;
};

/// Returns the bytes of a page, with its CRC-32 at the end.
Bytes encode_overlay_page(const OverlayPage& page);

/// Checks the checksum and decodes into `page`. Throws: Damage unless the page has `values` finite
/// values, in ascending order of clusters and indices, of clusters that the levels have.
void decode_overlay_page(ByteView bytes, std::uint64_t values, std::span<const LevelInfo> levels,
                         OverlayPage& page);

}  // namespace terrace::stream::store
