// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "format/record_parts.hpp"
#include "format/record_source.hpp"
#include "terrace/stream/point.hpp"
#include "terrace/stream/source.hpp"

/// The octree in which COPC and EPT arrange points: every node has some of the points in its cube,
/// and each depth has half the spacing of the previous one.

namespace terrace::stream {

/// Positions of deeper nodes do not fit into COPC's signed 32 bits.
inline constexpr unsigned kMaxDepth = 30;

/// A node with points.
struct OctreeNode {
  unsigned depth = 0;
  std::array<std::uint32_t, 3> position{};  ///< along x, y and z, below 2^depth
  std::uint64_t offset = 0;                 ///< offset of its points in the file
  std::uint64_t bytes = 0, points = 0;
};

/// Returns a node's key as EPT writes it: "D-X-Y-Z".
std::string key_of(const OctreeNode& node);

/// Orders parents before children, and siblings in Morton order.
bool precedes(const OctreeNode& a, const OctreeNode& b);

/// The cube of the root, and the nodes that have points.
struct Octree {
  Point3 centre{};
  double half_size = 0.0;  ///< half the side of the root's cube, in the CRS
  double spacing = 0.0;    ///< spacing of the root's points, in the CRS
  /// Nodes in the order of precedes(), so that consecutive nodes are close together.
  std::vector<OctreeNode> nodes;

  [[nodiscard]] Box3 box(const OctreeNode& node) const;
  [[nodiscard]] std::uint64_t points() const;
  /// Returns the public description of the nodes.
  [[nodiscard]] OctreeInfo info() const;
  /// Sorts the nodes. Returns a duplicate node, or nullptr if there is none.
  const OctreeNode* arrange();
  /// Keeps the nodes whose cubes, enlarged by two `steps`, meet the region, down to the first depth
  /// whose spacing is at most `resolution` (to any depth if that is 0). The first node is kept for
  /// any region: parts_in_cubes() checks the root's cube by its points.
  void keep(const std::optional<Box3>& region, double resolution, const Point3& steps);
};

/// Size of a step of the coordinates, in the CRS: points may be rounded across the sides of their
/// node.
Point3 steps_of(const Placement& placement);

/// Returns the same parts, one for each of the octree's nodes, with readers that check that a
/// node's points are in its cube. Regions select nodes by their cubes, so a wrong cube would
/// silently lose points. stream: the records and their placement. The readers throw: Error that
/// names `file` and the node.
RecordParts parts_in_cubes(RecordParts parts, const Octree& octree, const RecordStream& stream,
                           const std::string& file);

}  // namespace terrace::stream
