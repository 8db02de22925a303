// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <stdexcept>
#include <string>

#include <terrace/base/stop_check.hpp>
#include <terrace/base/union_find.hpp>

#include "linkage/neighbour_lists.hpp"
#include "linkage/points.hpp"
#include "linkage/spanning_tree.hpp"
#include "linkage/tree.hpp"
#include "terrace/cluster/linkage.hpp"

namespace terrace::cluster {
namespace {

/// Returns the first point at each position. The other points at the position are linked to it at
/// height 0, so the tree over the distinct points has only geometric ties.
std::vector<std::uint32_t> distinct(const std::vector<Point3>& points, std::vector<Link>& links,
                                    const base::StopCheck& check_stop) {
  constexpr std::size_t kTicksOfLookup = 64;
  base::StopTicks ticks(check_stop);
  const auto hash = [](const Point3& p) {
    std::uint64_t h = 0;
    for (const double v : p) {
      h = (h ^ std::bit_cast<std::uint64_t>(v)) * 0x9e3779b97f4a7c15u;
      h ^= h >> 29;
    }
    return h * 0xbf58476d1ce4e5b9u;
  };
  constexpr std::uint32_t kFree = 0xffffffffu;
  const auto bits = static_cast<unsigned>(std::bit_width(2 * points.size()));
  std::vector<std::uint32_t> table(std::size_t{1} << bits, kFree);
  std::vector<std::uint32_t> first;
  first.reserve(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    ticks(kTicksOfLookup);
    std::size_t slot = hash(points[i]) >> (64 - bits);
    while (table[slot] != kFree && points[table[slot]] != points[i]) {
      slot = (slot + 1) & (table.size() - 1);
    }
    if (table[slot] == kFree) {
      table[slot] = i;
      first.push_back(i);
    } else {
      links.push_back({table[slot], i, 0.0});
    }
  }
  return first;
}

}  // namespace

std::vector<Link> spanning_tree(std::span<const Point3> points, const LinkageOptions& options) {
  const LinkagePoints linkage_points(points);
  std::vector<Link> links;
  if (points.size() < 2) return links;
  links.reserve(points.size() - 1);
  const std::vector<std::uint32_t> first =
      distinct(linkage_points.scaled(), links, options.check_stop);
  if (first.size() < 2) return links;
  const LinkageTree tree(linkage_points.scaled(), first, options.threads, options.check_stop);
  const SpanningTree spanning(tree, options.threads, options.check_stop);
  for (const TreeEdge& edge : spanning.edges()) {
    links.push_back(
        {tree.number(edge.low), tree.number(edge.high), linkage_points.height(edge.square)});
  }
  return links;
}

Dendrogram single_linkage(std::span<const Point3> points, const LinkageOptions& options) {
  return make_dendrogram(points.size(), spanning_tree(points, options), options.check_stop);
}

Dendrogram single_linkage(std::span<const Point3> points, std::span<const PointPair> candidates,
                          const base::StopCheck& check_stop) {
  const LinkagePoints linkage_points(points);
  const std::vector<Point3>& scaled = linkage_points.scaled();
  std::vector<TreeEdge> edges(candidates.size());
  for (std::size_t e = 0; e < candidates.size(); ++e) {
    const auto [i, j] = candidates[e];
    if (i >= points.size() || j >= points.size()) {
      throw std::invalid_argument("candidate " + std::to_string(e) + " names point " +
                                  std::to_string(std::max(i, j)) + ", but there are only " +
                                  std::to_string(points.size()));
    }
    edges[e] = TreeEdge::of(squared_distance(scaled[i], scaled[j]), i, j);
  }
  base::StopTicks ticks(check_stop);
  std::sort(edges.begin(), edges.end(), [&](const TreeEdge& a, const TreeEdge& b) {
    ticks();
    return a < b;
  });
  base::UnionFind sets(points.size());
  std::vector<Link> links;
  for (const TreeEdge& edge : edges) {
    ticks(16);
    if (sets.unite(edge.low, edge.high)) {
      links.push_back({edge.low, edge.high, linkage_points.height(edge.square)});
    }
  }
  for (std::uint32_t i = 1; i < points.size(); ++i) {
    if (sets.find(i) != 0) {
      throw std::invalid_argument("the candidate pairs do not connect point " + std::to_string(i) +
                                  " with point 0; add the edges of a Delaunay triangulation");
    }
  }
  return make_dendrogram(points.size(), links, check_stop);
}

}  // namespace terrace::cluster
