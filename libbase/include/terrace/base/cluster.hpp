// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "terrace/base/box.hpp"

/// The vocabulary of a hierarchy of clusters, which one library builds, another stores and a third
/// triangulates.
///
/// Level 0 is full resolution; levels grow coarser upward to the *top*. A cluster of level L has
/// one *representative*, a point whose highest level is above L, and *members*, the points whose
/// highest level is exactly L. A point of highest level h heads one cluster on every level below h
/// and has their h ordinals (its *children*, level 0 first). The points of the top level, which no
/// cluster represents, are the *root*: cluster 0 of the top level, without a representative.

namespace terrace::base {

/// Identifies a cluster for the lifetime of its hierarchy: the level in the upper 8 bits, the
/// ordinal in the lower 56.
enum class ClusterId : std::uint64_t {};

/// Ordinals of clusters are below this.
inline constexpr std::uint64_t kClusterOrdinalEnd = std::uint64_t{1} << 56;

/// Requires level < 256 and ordinal < kClusterOrdinalEnd.
constexpr ClusterId cluster_id(unsigned level, std::uint64_t ordinal) {
  return ClusterId{(std::uint64_t{level} << 56) | ordinal};
}
constexpr unsigned level_of(ClusterId id) {
  return static_cast<unsigned>(static_cast<std::uint64_t>(id) >> 56);
}
constexpr std::uint64_t ordinal_of(ClusterId id) {
  return static_cast<std::uint64_t>(id) & (kClusterOrdinalEnd - 1);
}
/// Text for messages, such as "cluster 12 of level 3".
inline std::string to_string(ClusterId id) {
  return "cluster " + std::to_string(ordinal_of(id)) + " of level " + std::to_string(level_of(id));
}

/// Summary of all points below a cluster down to level 0, including its representative.
struct ClusterSummary {
  Box3 box;                       ///< box of the positions as stored
  double error = 0.0;             ///< upper bound of the ground distance from the representative
                                  ///< to a descendant, in ground units (metres)
  std::uint64_t descendants = 0;  ///< number of level-0 points

  friend bool operator==(const ClusterSummary&, const ClusterSummary&) = default;
};

/// Marks the missing representative of the root.
inline constexpr std::uint32_t kNoRepresentative = 0xffffffff;

/// A clustered block of one level. Points are numbered within the block. Cluster c has the points
/// order[first[c]] ... order[first[c + 1] - 1], including its representative. `children` has
/// `level` ordinals per point: the clusters that the point heads on levels 0, 1, ... The root is a
/// block of one cluster whose representative is kNoRepresentative.
struct ClusteredBlock {
  unsigned level = 0;
  std::uint64_t block = 0;  ///< ordinal of the block on its level
  std::span<const Point3> positions;
  std::span<const std::byte> payload;  ///< equally many bytes per point
  std::span<const std::uint64_t> children;
  std::span<const std::uint32_t> first;
  std::span<const std::uint32_t> order;
  std::span<const std::uint32_t> representatives;  ///< point number, one per cluster
  std::span<const ClusterSummary> summaries;       ///< one per cluster
};

}  // namespace terrace::base
