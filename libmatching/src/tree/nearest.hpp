// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "terrace/matching/point_hierarchy.hpp"
#include "tree/walk.hpp"

namespace terrace::matching::tree {

/// Factor for comparisons with a box's bound. It keeps rounding from pruning wrongly: the squared
/// distances of a box and of a primitive inside it are both accurate to about 2^-50.
inline constexpr double kSlack = 1.0 - 0x1p-47;

template <class AnyBox, std::size_t D>
double squared_distance(const AnyBox& box, const std::array<double, D>& p) {
  double sum = 0.0;
  for (std::size_t d = 0; d < D; ++d) {
    const double below = static_cast<double>(box.min[d]) - p[d];
    const double above = p[d] - static_cast<double>(box.max[d]);
    const double out = std::max(std::max(below, above), 0.0);
    sum += out * out;
  }
  return sum;
}

/// Calls leaf(node) for each leaf whose squared distance is at most bound(), nearer leaves first.
template <std::size_t D, class Bound, class Leaf>
void walk_near(const BoundingVolumeHierarchy<D>& tree, const std::array<double, D>& in_frame,
               Bound&& bound, Leaf&& leaf) {
  walk(
      tree, [&](const HierarchyNode<D>& node) { return squared_distance(node, in_frame); },
      [&](double distance) { return distance * kSlack <= bound(); }, leaf);
}

/// A squared distance in the hierarchy's scale and the index of its primitive. Ties go to the lower
/// index.
using Candidate = std::pair<double, std::uint32_t>;

/// Returns the nearest primitive. squared(slot) is the squared distance of the primitive in that
/// slot.
template <std::size_t D, class Squared>
std::optional<Neighbour> nearest_one(const BoundingVolumeHierarchy<D>& tree,
                                     const std::array<double, D>& in_frame, Squared&& squared) {
  Candidate best{std::numeric_limits<double>::infinity(), kNone};
  const std::uint32_t* order = tree.order().data();
  walk_near(
      tree, in_frame, [&] { return best.first; },
      [&](const HierarchyNode<D>& leaf) {
        for (std::uint32_t slot = leaf.link; slot < leaf.link + leaf.count; ++slot) {
          const double d = squared(slot);
          if (d <= best.first) best = std::min(best, Candidate{d, order[slot]});
        }
      });
  if (best.second == kNone) return std::nullopt;
  return Neighbour{best.second, std::sqrt(best.first) / tree.frame().scale};
}

/// Writes the k nearest primitives to `neighbours`, the nearest first.
template <std::size_t D, class Squared>
void nearest_few(const BoundingVolumeHierarchy<D>& tree, const std::array<double, D>& in_frame,
                 std::size_t k, Squared&& squared, std::vector<Neighbour>& neighbours) {
  neighbours.clear();
  k = std::min(k, tree.order().size());
  if (k == 0) return;
  // A heap with the farthest primitive on top. Distances stay squared until the end.
  const auto nearer = [](const Neighbour& p, const Neighbour& q) {
    return p.distance != q.distance ? p.distance < q.distance : p.index < q.index;
  };
  const std::uint32_t* order = tree.order().data();
  double bound = std::numeric_limits<double>::infinity();
  walk_near(
      tree, in_frame, [&] { return bound; },
      [&](const HierarchyNode<D>& leaf) {
        for (std::uint32_t slot = leaf.link; slot < leaf.link + leaf.count; ++slot) {
          const Neighbour candidate{order[slot], squared(slot)};
          if (candidate.distance > bound) continue;
          if (neighbours.size() == k) {
            if (!nearer(candidate, neighbours.front())) continue;
            std::pop_heap(neighbours.begin(), neighbours.end(), nearer);
            neighbours.back() = candidate;
          } else {
            neighbours.push_back(candidate);
          }
          std::push_heap(neighbours.begin(), neighbours.end(), nearer);
          if (neighbours.size() == k) bound = neighbours.front().distance;
        }
      });
  std::sort_heap(neighbours.begin(), neighbours.end(), nearer);
  for (Neighbour& neighbour : neighbours) {
    neighbour.distance = std::sqrt(neighbour.distance) / tree.frame().scale;
  }
}

}  // namespace terrace::matching::tree
