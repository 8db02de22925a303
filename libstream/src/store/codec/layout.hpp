// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "store/codec/bytes.hpp"
#include "store/codec/numbers.hpp"
#include "store/codec/split.hpp"
#include "store/codec/symbols.hpp"
#include "terrace/stream/store.hpp"

namespace terrace::stream::store {

/// Limits of the points of a cluster and of its decoded bytes (see Layout). A few bytes can
/// represent any number of points, so nothing else limits the cost of a damaged count.
inline constexpr std::uint32_t kMaxPoints = 1u << 20;
inline constexpr std::uint64_t kMaxDecodedBytes = std::uint64_t{1} << 28;
/// Limit of the coded bytes of a cluster; the limits above keep valid clusters far below it.
inline constexpr std::uint32_t kMaxBytes = 1u << 31;

/// Maximum clusters per page of the index. Every page of a level but the last has the same number,
/// so page numbers follow from ordinals.
inline constexpr std::uint32_t kMaxPageClusters = 64;
inline constexpr std::uint64_t kMinPageBytes = 4;

/// The common properties of the clusters of one level.
struct Layout {
  bool grid = false;
  unsigned level = 0;
  std::vector<ScalarType> attributes;
  std::vector<std::size_t> offsets;  ///< offsets of the attributes in the payload of a point
  std::size_t payload_size = 0;

  Layout(const Schema& schema, unsigned number)
      : grid(schema.grid), level(number), payload_size(schema.payload_size()) {
    std::size_t offset = 0;
    for (const Channel& channel : schema.attributes) {
      attributes.push_back(channel.type);
      offsets.push_back(offset);
      offset += size_of(channel.type);
    }
  }
  /// Maximum points of a cluster. Their coordinates, attributes and children fit into
  /// kMaxDecodedBytes.
  [[nodiscard]] std::uint64_t max_points() const {
    const std::uint64_t bytes = sizeof(Point3) + payload_size + sizeof(std::uint64_t) * level;
    return std::min<std::uint64_t>(kMaxPoints, kMaxDecodedBytes / bytes);
  }
  /// Number of columns: the attributes and the three axes.
  [[nodiscard]] unsigned columns() const { return static_cast<unsigned>(attributes.size()) + 3; }
  /// Clusters per page. Few enough that reading the unneeded entries of a page is cheap: entries
  /// above level 0 cover larger areas, and entries of rasters are large compared with their
  /// clusters.
  [[nodiscard]] std::uint64_t page_clusters() const {
    return level > 0 ? 4 : grid ? 16 : kMaxPageClusters;
  }
  /// Whether clusters are small and many, as on level 0 of rasters. They may then share bytes, and
  /// have short checksums.
  [[nodiscard]] bool small() const { return grid && level == 0; }
  [[nodiscard]] unsigned checksum_bits() const { return small() ? 8 : 16; }
  /// Returns the checksum that the index has for the bytes of a cluster.
  [[nodiscard]] std::uint16_t checksum(ByteView bytes) const {
    return small() ? crc8(bytes) : crc16(bytes);
  }
  [[nodiscard]] unsigned contexts() const {
    const auto ends = 2 * static_cast<unsigned>(attributes.size());
    return index_context() + context::kIndexRange + ends;
  }
  /// Return the first contexts of borders and of the index.
  [[nodiscard]] unsigned border_context() const { return first_context(columns()); }
  [[nodiscard]] unsigned index_context() const { return border_context() + context::kBorders; }
  /// Whether points that are not split are coded as columns instead of rows of a raster.
  [[nodiscard]] bool has_point_columns() const { return !grid || level > 0; }
  /// Returns the first context of a column.
  [[nodiscard]] unsigned first_context(unsigned column) const {
    return context::kAttribute + column * context::kPerAttribute;
  }
  /// Whether the differences of the column may be predicted from those of the preceding one. Both
  /// must be attributes of integer types.
  [[nodiscard]] bool may_use_preceding(unsigned column) const {
    const auto integer = [](ScalarType t) { return t != ScalarType::f32 && t != ScalarType::f64; };
    return column > 0 && column < attributes.size() && integer(attributes[column]) &&
           integer(attributes[column - 1]);
  }
};

/// A cluster's entry in the index, as integers.
struct Entry {
  std::uint32_t bytes = 0;
  std::uint32_t points = 0;  ///< including the representative
  std::array<NumberForm, 3> forms{};
  std::array<std::int64_t, 3> low{};  ///< lower corner of the box, in the form of each axis
  std::array<std::uint64_t, 3> size{1, 1, 1};  ///< size of the box: integers per axis
  std::uint16_t error = 0;                     ///< see error_code
  std::uint64_t descendants = 0;               ///< 0 on level 0
  std::uint16_t checksum = 0;                  ///< checksum of the bytes
  std::int64_t jump = 0;  ///< from the end of the previous cluster's bytes to these
};

/// The lowest and the highest value of an attribute in a cluster, as unsigned integers in the order
/// of the values (see attribute_key).
struct KeyRange {
  std::uint64_t low = UINT64_MAX, high = 0;
};

constexpr std::uint64_t attribute_key(std::int64_t value) {
  return static_cast<std::uint64_t>(value) ^ std::uint64_t{1} << 63;
}
/// A NaN comes after the infinity of its sign.
constexpr std::uint64_t attribute_key(double value) {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  return bits >> 63 != 0 ? ~bits : bits | std::uint64_t{1} << 63;
}
constexpr double double_of_key(std::uint64_t key) {
  return std::bit_cast<double>(key >> 63 != 0 ? key ^ std::uint64_t{1} << 63 : ~key);
}

/// Returns the range of the attribute's real values, computed as a reader of the points computes
/// them, so that rounding does not exclude any.
inline ValueRange value_range(const Channel& channel, const KeyRange& keys) {
  const bool floating = channel.type == ScalarType::f32 || channel.type == ScalarType::f64;
  const auto value = [&](std::uint64_t key) {
    if (floating) return double_of_key(key);
    if (channel.type == ScalarType::u64) return static_cast<double>(key);
    return static_cast<double>(static_cast<std::int64_t>(key ^ std::uint64_t{1} << 63));
  };
  const double ends[] = {value(keys.low) * channel.scale + channel.offset,
                         value(keys.high) * channel.scale + channel.offset};
  if (!(std::isfinite(ends[0]) && std::isfinite(ends[1]))) return {};
  return {std::min(ends[0], ends[1]), std::max(ends[0], ends[1]), false};
}

/// An error is stored as 16 bits, the upper bits of the double (5 of the mantissa), never rounded
/// down.
inline constexpr unsigned kErrorShift = 47;
constexpr std::uint16_t error_code(double error) {
  const auto bits = std::bit_cast<std::uint64_t>(error);
  return static_cast<std::uint16_t>((bits + ((std::uint64_t{1} << kErrorShift) - 1)) >>
                                    kErrorShift);
}
constexpr double error_of(std::uint16_t code) {
  return std::bit_cast<double>(std::uint64_t{code} << kErrorShift);
}

/// Converts an entry to the record that callers of the reader see. root: all points are members.
inline ClusterRecord record_of(const Entry& entry, unsigned level, std::uint64_t offset,
                               bool root) {
  ClusterRecord record;
  if (entry.points > 0) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t high = static_cast<std::int64_t>(
          static_cast<std::uint64_t>(entry.low[axis]) + entry.size[axis] - 1);
      record.summary.box.min[axis] = to_double(entry.low[axis], entry.forms[axis]);
      record.summary.box.max[axis] = to_double(high, entry.forms[axis]);
    }
  }
  record.summary.error = error_of(entry.error);
  record.summary.descendants = level == 0 ? entry.points : entry.descendants;
  record.offset = offset;
  record.bytes = entry.bytes;
  record.points = root || entry.points == 0 ? entry.points : entry.points - 1;
  return record;
}

}  // namespace terrace::stream::store
