// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/cluster/dendrogram.hpp"

/// Agglomeration of nearest clusters, for any distances between clusters. Private to linkage.
///
/// Clusters are in slots, initially one point each. When two merge, the higher slot holds the
/// result and the lower one is dead, as in SciPy. A type of clusters derives from ClusterSlots and
/// has:
/// - distance(a, b), symmetric to the last bit;
/// - nearest(x, begin, end, best): returns the nearest live slot to x within [begin, end) if it is
///   strictly nearer than `best`, otherwise `best`. On ties the first slot wins.
/// - join(low, high, between): updates the distances of `high` for the merged cluster. `between` is
///   the distance of the two.
/// - move(kept): the slots `kept` become 0, 1, ..
/// - height(distance), as in the dendrogram.

namespace terrace::cluster {

inline constexpr std::uint32_t kNoCluster = 0xffffffffu;

struct NearCluster {
  double distance = std::numeric_limits<double>::infinity();
  std::uint32_t cluster = kNoCluster;
};

class ClusterSlots {
 public:
  /// check_stop: must outlive this object.
  ClusterSlots(std::size_t count, const base::StopCheck& check_stop)
      : points_(count, 1.0), name_(count), ticks_(check_stop) {
    std::iota(name_.begin(), name_.end(), 0u);
  }
  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(name_.size()); }
  [[nodiscard]] bool alive(std::uint32_t slot) const { return points_[slot] > 0.0; }
  /// Returns the number of points, or 0 for a dead slot.
  [[nodiscard]] double points(std::uint32_t slot) const { return points_[slot]; }
  [[nodiscard]] const double* points() const { return points_.data(); }
  /// Returns a point of the cluster.
  [[nodiscard]] std::uint32_t name(std::uint32_t slot) const { return name_[slot]; }

  /// Counts distances and calls the stop check from time to time. Throws whatever it throws.
  void tick(std::size_t distances) { ticks_(distances); }

  void count_as_one(std::uint32_t low, std::uint32_t high) {
    points_[high] += points_[low];
    points_[low] = 0.0;
  }
  void keep(const std::vector<std::uint32_t>& kept) {
    for (std::size_t k = 0; k < kept.size(); ++k) {
      points_[k] = points_[kept[k]];
      name_[k] = name_[kept[k]];
    }
    points_.resize(kept.size());
    name_.resize(kept.size());
  }

 private:
  std::vector<double> points_;
  std::vector<std::uint32_t> name_;
  base::StopTicks ticks_;
};

/// Merges two slots. Returns the link with its height.
template <class Clusters>
Link merge_slots(Clusters& clusters, std::uint32_t a, std::uint32_t b, double distance) {
  const auto [low, high] = std::minmax({a, b});
  const Link link{clusters.name(low), clusters.name(high), clusters.height(distance)};
  clusters.join(low, high, distance);
  clusters.count_as_one(low, high);
  return link;
}

/// Returns the live slots if at least half of the slots are dead and there are enough to be worth
/// moving, otherwise an empty list.
template <class Clusters>
std::vector<std::uint32_t> slots_to_keep(const Clusters& clusters, std::uint32_t alive) {
  constexpr std::uint32_t kWorthMoving = 64;
  std::vector<std::uint32_t> kept;
  if (clusters.size() < kWorthMoving || 2 * alive > clusters.size()) return kept;
  kept.reserve(alive);
  for (std::uint32_t slot = 0; slot < clusters.size(); ++slot) {
    if (clusters.alive(slot)) kept.push_back(slot);
  }
  return kept;
}

/// Returns all merges, for methods in which a merge never brings the new cluster nearer to others
/// than its parts were. A chain leads from cluster to nearest cluster until two are each other's
/// nearest; these merge. Takes O(n^2) distances. On ties the previous cluster of the chain is
/// preferred, then the lowest slot. A chain begins at the lowest live slot. Links are in no
/// particular order, except that parts come before wholes.
template <class Clusters>
std::vector<Link> chain_links(Clusters& clusters) {
  std::vector<Link> links;
  std::vector<double> height(clusters.size(), 0.0);
  std::vector<std::uint32_t> chain, place(clusters.size(), kNoCluster);
  std::uint32_t alive = clusters.size(), start = 0;
  const auto cut = [&](std::size_t length) {
    for (; chain.size() > length; chain.pop_back()) place[chain.back()] = kNoCluster;
  };
  const auto push = [&](std::uint32_t slot) {
    place[slot] = static_cast<std::uint32_t>(chain.size());
    chain.push_back(slot);
  };
  while (alive > 1) {
    if (chain.empty()) {
      while (!clusters.alive(start)) ++start;
      push(start);
    }
    clusters.tick(clusters.size());
    const std::uint32_t x = chain.back();
    NearCluster before;
    if (chain.size() > 1) {
      before.cluster = chain[chain.size() - 2];
      before.distance = clusters.distance(x, before.cluster);
    }
    const NearCluster near = clusters.nearest(x, 0, clusters.size(), before);
    if (near.cluster != before.cluster) {
      // Only rounding can lead back into the chain.
      if (place[near.cluster] != kNoCluster) cut(place[near.cluster]);
      push(near.cluster);
      continue;
    }
    cut(chain.size() - 2);
    const auto [low, high] = std::minmax({x, near.cluster});
    Link link = merge_slots(clusters, low, high, near.distance);
    // Keeps rounding from sorting a whole before its parts.
    link.height = height[high] = std::max({link.height, height[low], height[high]});
    links.push_back(link);
    --alive;
    const std::vector<std::uint32_t> kept = slots_to_keep(clusters, alive);
    if (kept.empty()) continue;
    clusters.move(kept);
    clusters.keep(kept);
    std::vector<std::uint32_t> new_place(kept.size());
    for (std::uint32_t k = 0; k < kept.size(); ++k) {
      height[k] = height[kept[k]];
      new_place[k] = place[kept[k]];
      if (new_place[k] != kNoCluster) chain[new_place[k]] = k;
    }
    place = std::move(new_place);
    start = 0;
  }
  return links;
}

/// Returns all merges in their order, for any distances. Each joins the two nearest clusters, on
/// ties the pair of the lowest slots. Takes O(n^2) distances if each cluster is the nearest of few
/// others, which always holds for places in space.
template <class Clusters>
std::vector<Link> nearest_pair_links(Clusters& clusters) {
  std::vector<Link> links;
  // The first nearest slot after each slot, cyclically. So equal points form a chain in which a
  // merge affects few entries, and the least pair is found first.
  std::vector<NearCluster> nearest(clusters.size());
  const auto find = [&](std::uint32_t x) {
    clusters.tick(clusters.size());
    nearest[x] = clusters.nearest(x, 0, x, clusters.nearest(x, x + 1, clusters.size(), {}));
  };
  const auto comes_first = [&](std::uint32_t x, std::uint32_t a, std::uint32_t b) {
    return (a > x) == (b > x) ? a < b : a > x;
  };
  for (std::uint32_t x = 0; x < clusters.size(); ++x) find(x);
  for (std::uint32_t alive = clusters.size(); alive > 1; --alive) {
    std::uint32_t x = kNoCluster;
    for (std::uint32_t k = 0; k < clusters.size(); ++k) {
      if (!clusters.alive(k)) continue;
      if (x == kNoCluster || nearest[k].distance < nearest[x].distance) x = k;
    }
    const auto [low, high] = std::minmax({x, nearest[x].cluster});
    links.push_back(merge_slots(clusters, low, high, nearest[x].distance));
    for (std::uint32_t k = 0; k < clusters.size(); ++k) {
      if (!clusters.alive(k) || k == high) continue;
      const double distance = clusters.distance(k, high);
      NearCluster& near = nearest[k];
      if (distance < near.distance) {
        near = {distance, high};
      } else if (near.cluster == low || near.cluster == high) {
        find(k);
      } else if (distance == near.distance && comes_first(k, high, near.cluster)) {
        near.cluster = high;
      }
    }
    find(high);
    const std::vector<std::uint32_t> kept = slots_to_keep(clusters, alive - 1);
    if (kept.empty()) continue;
    std::vector<std::uint32_t> moved(clusters.size(), kNoCluster);
    for (std::uint32_t k = 0; k < kept.size(); ++k) moved[kept[k]] = k;
    clusters.move(kept);
    clusters.keep(kept);
    for (std::uint32_t k = 0; k < kept.size(); ++k) {
      const NearCluster near = nearest[kept[k]];
      nearest[k] = {near.distance, near.cluster == kNoCluster ? kNoCluster : moved[near.cluster]};
    }
    nearest.resize(kept.size());
  }
  return links;
}

}  // namespace terrace::cluster
