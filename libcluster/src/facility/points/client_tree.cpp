// SPDX-License-Identifier: Apache-2.0
#include "facility/points/client_tree.hpp"

#include <algorithm>
#include <array>
#include <numeric>

#include "ground.hpp"

namespace terrace::cluster {
namespace {

// Few enough that most clients of a leaf are worth examining if the leaf is.
constexpr std::uint32_t kLeaf = 16;

}  // namespace

ClientTree::ClientTree(Kind kind, std::span<const Point3> points)
    : order_(points.size()), leaf_(points.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  Node root;
  root.box = base::box_of(points);
  root.count = static_cast<std::uint32_t>(points.size());
  nodes_.push_back(root);
  // Children are appended, so the loop reaches them.
  for (std::uint32_t n = 0; n < nodes_.size(); ++n) split(n, kind, points);
  for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
    const Node& node = nodes_[n];
    if (node.child_count > 0) continue;
    // Ascending, as the other strategies visit clients.
    const auto begin = order_.begin() + node.first;
    std::sort(begin, begin + node.count);
    for (std::uint32_t k = 0; k < node.count; ++k) leaf_[order_[node.first + k]] = n;
  }
}

void ClientTree::split(std::uint32_t node, Kind kind, std::span<const Point3> points) {
  const Node parent = nodes_[node];
  if (parent.count <= kLeaf) return;
  const Point3 size = difference(parent.box.max, parent.box.min);
  const auto begin = order_.begin() + parent.first;
  const auto end = begin + parent.count;
  std::array<std::uint32_t, 9> ends{};  // end of each part
  std::size_t parts = 1;
  ends[0] = parent.first;
  ends[1] = parent.first + parent.count;
  if (kind == Kind::kd_tree) {
    const std::size_t axis =
        static_cast<std::size_t>(std::max_element(size.begin(), size.end()) - size.begin());
    if (size[axis] == 0.0) return;
    const std::uint32_t half = parent.count / 2;
    std::nth_element(begin, begin + half, end, [&](std::uint32_t a, std::uint32_t b) {
      return points[a][axis] != points[b][axis] ? points[a][axis] < points[b][axis] : a < b;
    });
    parts = 2;
    ends[2] = ends[1];
    ends[1] = parent.first + half;
  } else {
    // The bounding box is tight, so both halves of a side that is not 0 have points.
    const std::size_t axes = kind == Kind::octree ? 3 : 2;
    if (std::all_of(size.begin(), size.begin() + axes, [](double s) { return s == 0.0; })) return;
    for (std::size_t axis = 0; axis < axes; ++axis) {
      double middle = parent.box.min[axis] + 0.5 * size[axis];
      if (middle >= parent.box.max[axis]) middle = parent.box.min[axis];  // adjacent doubles
      for (std::size_t part = parts; part-- > 0;) {
        const auto from = order_.begin() + ends[part];
        const auto to = order_.begin() + ends[part + 1];
        const auto cut =
            std::partition(from, to, [&](std::uint32_t i) { return points[i][axis] <= middle; });
        ends[2 * part + 2] = ends[part + 1];
        ends[2 * part + 1] = static_cast<std::uint32_t>(cut - order_.begin());
        ends[2 * part] = ends[part];
      }
      parts *= 2;
    }
  }
  const auto first_child = static_cast<std::uint32_t>(nodes_.size());
  for (std::size_t part = 0; part < parts; ++part) {
    if (ends[part] == ends[part + 1]) continue;
    Node child;
    child.parent = node;
    child.first = ends[part];
    child.count = ends[part + 1] - ends[part];
    child.box = Box3{};
    for (std::uint32_t k = 0; k < child.count; ++k) {
      child.box.include(points[order_[child.first + k]]);
    }
    nodes_.push_back(child);
  }
  nodes_[node].first_child = first_child;
  nodes_[node].child_count = static_cast<std::uint32_t>(nodes_.size()) - first_child;
}

double ClientTree::longest_below(const Node& node, std::span<const double> connections) const {
  double longest = 0.0;
  for (std::uint32_t c = 0; c < node.child_count; ++c) {
    longest = std::max(longest, nodes_[node.first_child + c].longest);
  }
  if (node.child_count == 0) {
    for (std::uint32_t k = 0; k < node.count; ++k) {
      longest = std::max(longest, connections[order_[node.first + k]]);
    }
  }
  return longest;
}

void ClientTree::set(std::span<const double> connections) {
  for (std::size_t n = nodes_.size(); n-- > 0;) {
    nodes_[n].longest = longest_below(nodes_[n], connections);
  }
}

void ClientTree::update(std::span<const std::uint32_t> changed,
                        std::span<const double> connections) {
  marked_.clear();
  for (const std::uint32_t client : changed) marked_.push_back(leaf_[client]);
  std::sort(marked_.begin(), marked_.end());
  marked_.erase(std::unique(marked_.begin(), marked_.end()), marked_.end());
  for (std::uint32_t n : marked_) {
    for (;;) {
      const double longest = longest_below(nodes_[n], connections);
      if (longest == nodes_[n].longest) break;
      nodes_[n].longest = longest;
      if (n == 0) break;
      n = nodes_[n].parent;
    }
  }
}

}  // namespace terrace::cluster
