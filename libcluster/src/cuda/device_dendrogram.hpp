// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "cuda/device_primitives.hpp"
#include "linkage/points.hpp"
#include "linkage/tree.hpp"
#include "terrace/cluster/dendrogram.hpp"

namespace terrace::cluster::device {

/// Returns the dendrogram of points. `rounds` returns the links of at least two scaled points, like
/// complete_rounds() and single_rounds().
template <class Rounds>
Dendrogram dendrogram_of(const LinkagePoints& points, const Rounds& rounds) {
  const std::size_t count = points.scaled().size();
  if (count < 2) return make_dendrogram(count, {});
  // In the order of a kd-tree, most clusters that merge have nearby rows in the matrix.
  std::vector<std::uint32_t> all(count);
  std::iota(all.begin(), all.end(), 0u);
  const LinkageTree tree(points.scaled(), all, 1);
  std::vector<Point3> ordered(count);
  for (std::size_t i = 0; i < count; ++i) ordered[i] = tree.point(i);
  std::vector<Link> links;
  links.reserve(count);
  for (const RoundLink& link : rounds(std::span<const Point3>(ordered))) {
    links.push_back({tree.number(link.i), tree.number(link.j), points.height(link.square)});
  }
  return make_dendrogram(count, links);
}

}  // namespace terrace::cluster::device
