// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/point.hpp"

/// The octree of COPC 1.0 (Cloud Optimized Point Cloud, copc.io): a LAZ file of LAS 1.4 in which
/// every chunk is a node.

namespace terrace::stream {

/// The VLR that marks COPC, the first of the file.
inline constexpr std::string_view kCopcUser = "copc";
inline constexpr std::uint16_t kCopcInfo = 1;

/// A node with points.
struct CopcNode {
  unsigned depth = 0;
  std::array<std::uint32_t, 3> place{};  ///< along x, y and z, below 2^depth
  std::uint64_t offset = 0;              ///< of its chunk in the file
  std::uint64_t bytes = 0, points = 0;
};

struct CopcOctree {
  Point3 centre{};
  double half_size = 0.0;  ///< of the root's cube, in the CRS
  double spacing = 0.0;    ///< of the root's points, in the CRS
  /// Depth first, parents before children and these in Morton order: nodes that follow one another
  /// lie together.
  std::vector<CopcNode> nodes;

  [[nodiscard]] Box3 box(const CopcNode& node) const;
  /// Keeps the nodes down to the first depth whose spacing is at most `resolution` (all, if that is
  /// 0) whose cubes, grown by `margin`, meet the region.
  void keep(const std::optional<Box3>& region, double resolution, const Point3& margin);
};

/// Reads the whole hierarchy. info: the payload of the info VLR; first_chunk: where the first chunk
/// of the file begins; points: how many its header promises. Memory: 56 bytes per node.
/// Throws: Error unless pages and nodes lie in the file, no page is referred to twice, no two nodes
/// have the same key or bytes, and the nodes have exactly these points.
CopcOctree read_copc_octree(const ByteSource& file, std::string_view info,
                            std::uint64_t first_chunk, std::uint64_t points);

}  // namespace terrace::stream
