// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "terrace/cluster/point.hpp"

namespace terrace::cluster {

/// Clients in nested boxes, each with the longest connection of its clients. The tree is built
/// once; the connections change. Source: J. Skála, Algorithms for manipulating large geometric
/// data, 7.3.2, figure 7.9. It differs from that in: boxes are those of the points, not those of
/// the grid.
class ClientTree {
 public:
  enum class Kind : std::uint8_t {
    quadtree,  ///< halves x and y
    octree,    ///< halves x, y and z
    kd_tree,   ///< the longest side, at the median
  };

  struct Node {
    Box3 box;
    double longest = 0.0;
    std::uint32_t parent = 0;
    std::uint32_t first_child = 0, child_count = 0;  ///< consecutive nodes; none for a leaf
    std::uint32_t first = 0, count = 0;              ///< range in order()
  };

  /// O(n log n); a quadtree or octree may take O(n) levels, as many as the binary digits of the
  /// range of coordinates.
  ClientTree(Kind kind, std::span<const Point3> points);

  [[nodiscard]] const std::vector<Node>& nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<std::uint32_t>& order() const { return order_; }

  /// Reads all connections.
  void set(std::span<const double> connections);
  /// Reads the connections in the leaves of the changed clients, and propagates changes to the
  /// root.
  void update(std::span<const std::uint32_t> changed, std::span<const double> connections);

 private:
  void split(std::uint32_t node, Kind kind, std::span<const Point3> points);
  [[nodiscard]] double longest_below(const Node& node, std::span<const double> connections) const;

  std::vector<Node> nodes_;  // parents before children
  std::vector<std::uint32_t> order_;
  std::vector<std::uint32_t> leaf_;    // by client
  std::vector<std::uint32_t> marked_;  // leaves
};

}  // namespace terrace::cluster
