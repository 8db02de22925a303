// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "terrace/stream/store.hpp"

/// The surface of a scan, stored with its points: triangles, and for each vertex where it moves
/// when detail is removed. FORMAT.md describes the bytes.

namespace terrace::stream {

/// No point, or no cluster of a ClusterOrder.
inline constexpr std::uint32_t kNoNumber = std::numeric_limits<std::uint32_t>::max();

/// The clusters of a store in depth-first order: each before those that its members head, in the
/// order of the members, and last that of its representative. It numbers the points so that those
/// of a cluster are consecutive: the members of a cluster of level 0, then its representative.
struct ClusterOrder {
  struct Cluster {
    ClusterId id{};
    std::uint32_t parent = kNoNumber;  ///< index of the cluster above; kNoNumber for the root
    std::uint32_t next = 0;            ///< index of the first cluster that is not below this one
    std::uint32_t begin = 0, end = 0;  ///< its points and all below it, by number
    std::uint32_t representative = kNoNumber;  ///< the number of that point; kNoNumber in the root
  };
  std::vector<Cluster> clusters;  ///< the root first

  [[nodiscard]] std::uint32_t points() const { return clusters.front().end; }
};

/// Reads the order of a store's clusters: the clusters above level 0, and the index. 40 bytes per
/// cluster. Throws: Error if the store is damaged or has more points than 32-bit numbers.
[[nodiscard]] ClusterOrder cluster_order(const Store& store);

/// A surface through points of a store, by their numbers. All vectors but the last have a value for
/// each point; those of points that are not on the surface are as by default.
struct StoredSurface {
  explicit StoredSurface(std::size_t points = 0)
      : parents(points, kNoNumber), errors(points, 0.0), levels(points, 0) {}

  std::vector<std::uint32_t> parents;  ///< where a vertex moves; kNoNumber: it is always on it
  /// Errors in metres; stored with eight bits after the point of the mantissa, rounded up. Infinite
  /// for vertices without a parent.
  std::vector<double> errors;
  /// The vertex moves when the cluster of this level in which it is is collapsed.
  std::vector<std::uint8_t> levels;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  /// Returns which points are corners of triangles.
  [[nodiscard]] std::vector<bool> on_surface() const;
};

/// A surface must have: a parent on the surface, in the same cluster of the vertex's level, whose
/// level and error are not smaller; no vertex that represents a cluster moves while it is in it;
/// and only vertices without a parent remain of the root. The order of a surface's triangles, and
/// which corner is first, are not kept.
/// Throws: std::invalid_argument for a surface that is not as described.
[[nodiscard]] std::vector<std::byte> encode_surface(const ClusterOrder& order,
                                                    const StoredSurface& surface);
/// Decodes the output of encode_surface(); the surface is as described there. Memory is
/// proportional to the points and the bytes. Throws: Error, naming `file`, for damage.
[[nodiscard]] StoredSurface decode_surface(const ClusterOrder& order,
                                           std::span<const std::byte> bytes,
                                           const std::string& file);

}  // namespace terrace::stream
