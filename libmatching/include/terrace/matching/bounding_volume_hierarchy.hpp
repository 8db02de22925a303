// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// Bounding volume hierarchies from binary trees: a box for each node, in one array in the order of
/// a depth-first walk. What is asked of them is in point_hierarchy.hpp and triangle_hierarchy.hpp.

namespace terrace::matching {

template <std::size_t D>
struct Box {
  std::array<double, D> lo, hi;
};

/// A row of a binary tree, numbered as in matching_tree.hpp: nodes 0 .. n-1 are the primitives,
/// node n + r is that which row r makes of two earlier ones.
struct TreeChildren {
  std::uint32_t a, b;
};

/// The children alone, of rows of any kind that have them as a and b: MatchingTree::rows, SciPy's
/// linkage, a dendrogram.
template <class Rows>
[[nodiscard]] std::vector<TreeChildren> tree_children(const Rows& rows) {
  std::vector<TreeChildren> children;
  children.reserve(rows.size());
  for (const auto& row : rows) {
    children.push_back({static_cast<std::uint32_t>(row.a), static_cast<std::uint32_t>(row.b)});
  }
  return children;
}

/// The two constants of the surface area heuristic: one step in the tree, one test of a primitive.
struct SurfaceAreaCosts {
  double traversal = 1.0;
  double intersection = 1.0;
};

struct HierarchyOptions {
  /// Subtrees of at most so many primitives become one leaf where that lowers the cost.
  std::uint32_t leaf_size = 8;
  SurfaceAreaCosts costs{};
};

/// 32 bytes in space, 24 in the plane.
template <std::size_t D>
struct HierarchyNode {
  std::array<float, D> lo, hi;  ///< in the frame of the hierarchy, rounded outward
  std::uint32_t link;   ///< first slot of a leaf; else the second child, the first is the next node
  std::uint32_t count;  ///< primitives of a leaf; 0: not a leaf
};

/// Boxes are in floats: coordinates times `scale`, a power of two that is 1 unless they are beyond
/// 2^60 or all below 2^-60, less `centre`, the middle of all. So places on the earth in metres
/// keep their precision, and coordinates of 1e300 or 1e-300 are fine.
template <std::size_t D>
struct HierarchyFrame {
  double scale = 1.0;
  std::array<double, D> centre{};
  double reach = 0.0;  ///< the largest coordinate in the frame, in magnitude
};

/// The tree and its boxes. D: 2 or 3.
template <std::size_t D>
class BoundingVolumeHierarchy {
 public:
  using Node = HierarchyNode<D>;

  BoundingVolumeHierarchy() = default;

  /// rows: one less than there are boxes; a tree of any shape.
  /// Throws: std::invalid_argument for another number of rows, a row that names a node which is not
  /// there yet or has a parent (the row is named), a box that is not finite or whose lo exceeds its
  /// hi (its index is named), a leaf size of 0, and costs that are negative or not finite.
  /// Cost: O(n) time; 80 bytes a box while it builds.
  BoundingVolumeHierarchy(std::span<const TreeChildren> rows, std::span<const Box<D>> boxes,
                          const HierarchyOptions& options = {});

  [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }  ///< the root first
  /// The primitives in the order of the leaves: a leaf's are those in its slots.
  [[nodiscard]] std::span<const std::uint32_t> order() const { return order_; }
  [[nodiscard]] const HierarchyFrame<D>& frame() const { return frame_; }
  [[nodiscard]] std::size_t depth() const { return depth_; }  ///< nodes above the deepest leaf

  /// Expected cost of a random ray that meets the root's box: (traversal * sum of the areas of the
  /// inner nodes + intersection * sum of area times primitives of the leaves) / area of the root.
  /// Area is the surface, in the plane the perimeter. Where the root's is 0 (a point, a line along
  /// an axis in space) every node counts as if it were as large as the root.
  /// Source: J. D. MacDonald and K. S. Booth, "Heuristics for ray tracing using space subdivision",
  /// 1990; I. Wald, "On fast construction of SAH-based bounding volume hierarchies", 2007.
  [[nodiscard]] double surface_area_cost(const SurfaceAreaCosts& costs = {}) const;

 private:
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
  HierarchyFrame<D> frame_;
  std::size_t depth_ = 0;
};

/// A tree of less cost over the same boxes: from the leaves upward, where that makes the boxes
/// smaller, a child changes places with a child of its sibling, or two children of siblings with
/// one another; again and again until a pass gains less than one part in a thousand, or `passes`
/// are done. Pairs of primitives stay pairs. A tree of matchings loses 2 to 5 % of its
/// cost by it on even sets, 23 % on clumps of points (measured).
///
/// Returns: as many rows, with children before parents.
/// Throws: std::invalid_argument for rows and boxes as BoundingVolumeHierarchy does.
/// Cost: O(n) time a pass, 0.5 us a box in all (measured, 100,000 points); 150 bytes a box.
/// Source: A. Kensler, "Tree rotations for improving bounding volume hierarchies", 2008.
template <std::size_t D>
[[nodiscard]] std::vector<TreeChildren> rotate_tree(std::span<const TreeChildren> rows,
                                                    std::span<const Box<D>> boxes,
                                                    unsigned passes = 16);

extern template class BoundingVolumeHierarchy<2>;
extern template class BoundingVolumeHierarchy<3>;

}  // namespace terrace::matching
