// SPDX-License-Identifier: Apache-2.0
#include "format/octree.hpp"

#include <algorithm>
#include <cmath>

namespace terrace::stream {

std::string name_of(const OctreeNode& node) {
  std::string name = std::to_string(node.depth);
  for (const std::uint32_t place : node.place) name.append("-").append(std::to_string(place));
  return name;
}

bool before(const OctreeNode& a, const OctreeNode& b) {
  // The axis whose places differ in the highest bit decides; of equal ones the first, z.
  std::uint32_t most = 0;
  bool less = false;
  for (const std::size_t axis : {std::size_t{2}, std::size_t{1}, std::size_t{0}}) {
    const std::uint32_t p = a.place[axis] << (kDeepestNode - a.depth);
    const std::uint32_t q = b.place[axis] << (kDeepestNode - b.depth);
    const std::uint32_t differ = p ^ q;
    if (most < differ && most < (differ ^ most)) {
      most = differ;
      less = p < q;
    }
  }
  return most == 0 ? a.depth < b.depth : less;
}

Box3 Octree::box(const OctreeNode& node) const {
  const double side = std::ldexp(2 * half_size, -static_cast<int>(node.depth));
  Box3 box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.min[axis] = centre[axis] - half_size + side * node.place[axis];
    box.max[axis] = box.min[axis] + side;
  }
  return box;
}

std::uint64_t Octree::points() const {
  std::uint64_t points = 0;
  for (const OctreeNode& node : nodes) points += node.points;
  return points;
}

OctreeInfo Octree::info() const {
  OctreeInfo facts{.spacing = spacing, .nodes = nodes.size()};
  for (const OctreeNode& node : nodes) facts.depths = std::max(facts.depths, node.depth + 1);
  return facts;
}

const OctreeNode* Octree::arrange() {
  std::sort(nodes.begin(), nodes.end(), before);
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    if (!before(nodes[i - 1], nodes[i])) return &nodes[i];
  }
  return nullptr;
}

void Octree::keep(const std::optional<Box3>& region, double resolution, const Point3& margin) {
  unsigned deepest = kDeepestNode;
  if (resolution > 0) {
    deepest = 0;
    while (deepest < kDeepestNode && std::ldexp(spacing, -static_cast<int>(deepest)) > resolution) {
      ++deepest;
    }
  }
  std::erase_if(nodes, [&](const OctreeNode& node) {
    if (node.depth > deepest) return true;
    if (!region) return false;
    const Box3 cube = box(node);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (cube.min[axis] - margin[axis] > region->max[axis] ||
          cube.max[axis] + margin[axis] < region->min[axis]) {
        return true;
      }
    }
    return false;
  });
}

}  // namespace terrace::stream
