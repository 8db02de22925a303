// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/dendrogram.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include <terrace/base/stop_check.hpp>
#include <terrace/base/union_find.hpp>

namespace terrace::cluster {
namespace {

constexpr std::uint32_t kNoLabel = 0xffffffffu;

std::string link_text(const Link& link) {
  return "points " + std::to_string(link.i) + " and " + std::to_string(link.j);
}

/// Returns the indices of the links sorted by height, with ties in their original order.
std::vector<std::uint32_t> by_height(std::span<const Link> links, base::StopTicks& ticks) {
  struct Key {
    double height;
    std::uint32_t link;
  };
  std::vector<Key> keys(links.size());
  for (std::uint32_t r = 0; r < links.size(); ++r) keys[r] = {links[r].height, r};
  std::sort(keys.begin(), keys.end(), [&](const Key& x, const Key& y) {
    ticks();
    return x.height < y.height || (x.height == y.height && x.link < y.link);
  });
  std::vector<std::uint32_t> order(links.size());
  for (std::size_t r = 0; r < order.size(); ++r) order[r] = keys[r].link;
  return order;
}

/// Returns the greatest height in the subtree of each merge, including its own.
std::vector<double> subtree_heights(const Dendrogram& dendrogram) {
  const std::size_t n = dendrogram.points;
  std::vector<double> heights;
  heights.reserve(dendrogram.merges.size());
  for (const Merge& merge : dendrogram.merges) {
    double most = merge.height;
    for (const std::uint32_t part : {merge.a, merge.b}) {
      if (part >= n) most = std::max(most, heights[part - n]);
    }
    heights.push_back(most);
  }
  return heights;
}

/// Returns the labels of the flat clusters that result from all merges with a subtree height of at
/// most `height`.
std::vector<std::uint32_t> labels_below(const Dendrogram& dendrogram,
                                        const std::vector<double>& heights, double height) {
  const std::size_t n = dendrogram.points;
  // A cluster that is not merged further gets its own name. Others get the name from above.
  std::vector<std::uint32_t> name(n + heights.size(), kNoLabel);
  for (std::size_t r = heights.size(); r-- > 0;) {
    if (heights[r] > height) continue;
    const Merge& merge = dendrogram.merges[r];
    const auto self = static_cast<std::uint32_t>(n + r);
    if (name[self] == kNoLabel) name[self] = self;
    name[merge.a] = name[merge.b] = name[self];
  }
  std::vector<std::uint32_t> label(n + heights.size(), kNoLabel);
  std::vector<std::uint32_t> result(n);
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t cluster = name[i] == kNoLabel ? i : name[i];
    if (label[cluster] == kNoLabel) label[cluster] = next++;
    result[i] = label[cluster];
  }
  return result;
}

/// Makes the dendrogram of links taken in the given order.
Dendrogram join(std::size_t points, std::span<const Link> links,
                std::span<const std::uint32_t> order, base::StopTicks& ticks) {
  constexpr std::size_t kTicksOfJoin = 64;
  Dendrogram dendrogram{.points = points, .merges = {}};
  dendrogram.merges.reserve(links.size());
  base::UnionFind sets(points);
  std::vector<std::uint32_t> cluster(points);
  std::vector<std::uint32_t> size(points, 1);
  std::iota(cluster.begin(), cluster.end(), 0u);
  auto next = static_cast<std::uint32_t>(points);
  for (const std::uint32_t r : order) {
    ticks(kTicksOfJoin);
    const std::uint32_t x = sets.find(links[r].i);
    const std::uint32_t y = sets.find(links[r].j);
    if (!sets.unite(x, y)) {
      throw std::invalid_argument("link " + std::to_string(r) + ": " + link_text(links[r]) +
                                  " are already in one cluster; links must form a tree");
    }
    const std::uint32_t root = std::min(x, y);
    const auto [a, b] = std::minmax(cluster[x], cluster[y]);
    size[root] = size[x] + size[y];
    dendrogram.merges.push_back({a, b, links[r].height, size[root]});
    cluster[root] = next++;
  }
  return dendrogram;
}

void check_links(std::size_t points, std::span<const Link> links) {
  if (points > kMostDendrogramPoints) {
    throw std::invalid_argument(std::to_string(points) + " points are too many: a dendrogram has " +
                                "at most 2^31");
  }
  if (links.size() != (points == 0 ? 0 : points - 1)) {
    throw std::invalid_argument(std::to_string(links.size()) + " links for " +
                                std::to_string(points) +
                                " points; give one link fewer than points");
  }
  for (std::size_t r = 0; r < links.size(); ++r) {
    const Link& link = links[r];
    const auto fail = [&](const char* what) {
      throw std::invalid_argument("link " + std::to_string(r) + " of " + link_text(link) + " " +
                                  what);
    };
    if (link.i >= points || link.j >= points) fail("names a point that does not exist");
    if (!(link.height >= 0.0)) fail("has a height that is negative or NaN");
  }
}

}  // namespace

Dendrogram make_dendrogram(std::size_t points, std::span<const Link> links,
                           const base::StopCheck& check_stop) {
  check_links(points, links);
  base::StopTicks ticks(check_stop);
  return join(points, links, by_height(links, ticks), ticks);
}

Dendrogram make_dendrogram_in_order(std::size_t points, std::span<const Link> links,
                                    const base::StopCheck& check_stop) {
  check_links(points, links);
  std::vector<std::uint32_t> order(links.size());
  std::iota(order.begin(), order.end(), 0u);
  base::StopTicks ticks(check_stop);
  return join(points, links, order, ticks);
}

std::vector<std::uint32_t> cut_height(const Dendrogram& dendrogram, double height) {
  if (std::isnan(height)) throw std::invalid_argument("the height of the cut is NaN");
  return labels_below(dendrogram, subtree_heights(dendrogram), height);
}

std::vector<std::uint32_t> cut_count(const Dendrogram& dendrogram, std::size_t count) {
  const std::size_t n = dendrogram.points;
  if (count == 0 || count > n) {
    throw std::invalid_argument(std::to_string(n) + " points cannot be cut into " +
                                std::to_string(count) + " clusters; give from 1 to their number");
  }
  const std::vector<double> heights = subtree_heights(dendrogram);
  if (count == n) return labels_below(dendrogram, heights, -1.0);
  // The lowest height at which there are enough merges.
  std::vector<double> sorted = heights;
  const auto last = sorted.begin() + static_cast<std::ptrdiff_t>(n - count - 1);
  std::nth_element(sorted.begin(), last, sorted.end());
  return labels_below(dendrogram, heights, *last);
}

std::string dendrogram_fault(const Dendrogram& dendrogram) {
  const std::size_t n = dendrogram.points;
  if (n > kMostDendrogramPoints) return "more than 2^31 points";
  if (dendrogram.merges.size() != (n == 0 ? 0 : n - 1)) {
    return std::to_string(dendrogram.merges.size()) + " rows for " + std::to_string(n) + " points";
  }
  std::vector<bool> merged(2 * n, false);
  const auto size_of = [&](std::uint32_t cluster) {
    return cluster < n ? 1u : dendrogram.merges[cluster - n].size;
  };
  for (std::size_t r = 0; r < dendrogram.merges.size(); ++r) {
    const Merge& merge = dendrogram.merges[r];
    const std::string row = "row " + std::to_string(r) + ": ";
    if (!(merge.a < merge.b)) return row + "a is not below b";
    if (merge.b >= n + r) return row + "a cluster does not exist yet";
    if (merged[merge.a] || merged[merge.b]) return row + "a cluster is merged twice";
    merged[merge.a] = merged[merge.b] = true;
    if (merge.size != size_of(merge.a) + size_of(merge.b)) return row + "the size is wrong";
    if (!(merge.height >= 0.0)) return row + "the height is negative or NaN";
  }
  return {};
}

}  // namespace terrace::cluster
