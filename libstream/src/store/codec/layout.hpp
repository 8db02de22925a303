// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "store/codec/numbers.hpp"
#include "store/codec/split_codec.hpp"
#include "store/codec/symbols.hpp"
#include "terrace/stream/store.hpp"

namespace terrace::stream::store {

/// More points than this no cluster has, nor more bytes when it is decoded (see Layout): a few
/// bytes can stand for any number of points, so nothing else limits what a damaged count costs.
inline constexpr std::uint32_t kMostPoints = 1u << 20;
inline constexpr std::uint64_t kMostDecodedBytes = std::uint64_t{1} << 28;
/// Fewer bytes than this no cluster has that has points.
inline constexpr std::uint32_t kFewestClusterBytes = 4;
/// More bytes than this no cluster has: every point at its raw size, and as much again.
inline constexpr std::uint32_t kMostBytes = 1u << 31;

/// Stores of this version and earlier are read. A raster without further attributes is written as
/// version 1, which says it all.
inline constexpr int kVersion = 2;
inline int version_to_write(const Schema& schema) {
  return schema.grid && schema.attributes.empty() ? 1 : kVersion;
}

/// What the clusters of one level have in common.
struct Layout {
  int version = kVersion;
  bool grid = false;
  unsigned level = 0;
  std::vector<ScalarType> attributes;
  std::size_t payload_size = 0;

  Layout(const Schema& schema, unsigned of_level, int of_version)
      : version(of_version),
        grid(schema.grid),
        level(of_level),
        payload_size(schema.payload_size()) {
    for (const Channel& channel : schema.attributes) attributes.push_back(channel.type);
  }
  /// Most points in a cluster: their coordinates, attributes and children fit kMostDecodedBytes.
  [[nodiscard]] std::uint64_t most_points() const {
    const std::uint64_t bytes = sizeof(Point3) + payload_size + sizeof(std::uint64_t) * level;
    return std::min<std::uint64_t>(kMostPoints, kMostDecodedBytes / bytes);
  }
  /// Attributes and, from version 2 on, the three axes: what may be coded as a column.
  [[nodiscard]] unsigned columns() const {
    return static_cast<unsigned>(attributes.size()) + (version > 1 ? 3 : 0);
  }
  [[nodiscard]] unsigned contexts() const {
    return context::kAttribute + context::kPerAttribute * columns();
  }
  /// Whether the column may be coded beside the one before: attributes of integers.
  [[nodiscard]] bool may_lie_beside(unsigned column) const {
    const auto integer = [](ScalarType t) { return t != ScalarType::f32 && t != ScalarType::f64; };
    return column > 0 && column < attributes.size() && integer(attributes[column]) &&
           integer(attributes[column - 1]);
  }
};

/// A cluster's entry in the index, as integers.
struct Entry {
  std::uint32_t bytes = 0;
  std::uint32_t points = 0;  ///< representative included
  std::array<NumberForm, 3> forms{};
  std::array<std::int64_t, 3> low{};           ///< of the box, in the form of each axis
  std::array<std::uint64_t, 3> size{1, 1, 1};  ///< of the box: integers per axis
  std::uint16_t error = 0;                     ///< see error_code
  std::uint64_t descendants = 0;               ///< levels above 0
  std::uint16_t checksum = 0;                  ///< CRC-16 of the bytes
};

/// An error as 16 bits, never rounded down: the upper bits of the double (5 of the mantissa).
inline constexpr unsigned kErrorShift = 47;
constexpr std::uint16_t error_code(double error) {
  const auto bits = std::bit_cast<std::uint64_t>(error);
  return static_cast<std::uint16_t>((bits + ((std::uint64_t{1} << kErrorShift) - 1)) >>
                                    kErrorShift);
}
constexpr double error_of(std::uint16_t code) {
  return std::bit_cast<double>(std::uint64_t{code} << kErrorShift);
}

/// The entry as the reader's callers see it. `root`: all points are members.
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
