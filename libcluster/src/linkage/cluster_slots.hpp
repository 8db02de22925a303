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
/// - move(slots): makes `slots`, which are ascending, the slots 0, 1, ...
/// - height(distance): returns the height in the dendrogram.

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

  /// Adds the points of `low` to `high`. `low` is then dead.
  void merge_counts(std::uint32_t low, std::uint32_t high) {
    points_[high] += points_[low];
    points_[low] = 0.0;
  }
  /// Makes the given slots, which are ascending, the slots 0, 1, ...
  void compact(const std::vector<std::uint32_t>& slots) {
    for (std::size_t k = 0; k < slots.size(); ++k) {
      points_[k] = points_[slots[k]];
      name_[k] = name_[slots[k]];
    }
    points_.resize(slots.size());
    name_.resize(slots.size());
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
  clusters.merge_counts(low, high);
  return link;
}

/// Returns the live slots if at least half of the slots are dead and there are enough slots for
/// compaction to pay off. Otherwise returns an empty list.
template <class Clusters>
std::vector<std::uint32_t> live_slots_if_sparse(const Clusters& clusters, std::uint32_t alive) {
  constexpr std::uint32_t kMinSlots = 64;
  std::vector<std::uint32_t> slots;
  if (clusters.size() < kMinSlots || 2 * alive > clusters.size()) return slots;
  slots.reserve(alive);
  for (std::uint32_t slot = 0; slot < clusters.size(); ++slot) {
    if (clusters.alive(slot)) slots.push_back(slot);
  }
  return slots;
}

/// Returns all merges, for methods in which a new cluster is never nearer to others than its parts
/// were. A chain begins at the lowest live slot and leads from each cluster to its nearest, until
/// two are each other's nearest and merge. On ties the previous cluster of the chain is preferred,
/// then the lowest slot. Takes O(n^2) distances. The links of the parts of a cluster precede the
/// link of the cluster, but otherwise links are in no particular order.
template <class Clusters>
std::vector<Link> chain_links(Clusters& clusters) {
  std::vector<Link> links;
  std::vector<double> height(clusters.size(), 0.0);
  std::vector<std::uint32_t> chain, chain_position(clusters.size(), kNoCluster);
  std::uint32_t alive = clusters.size(), start = 0;
  const auto cut = [&](std::size_t length) {
    for (; chain.size() > length; chain.pop_back()) chain_position[chain.back()] = kNoCluster;
  };
  const auto push = [&](std::uint32_t slot) {
    chain_position[slot] = static_cast<std::uint32_t>(chain.size());
    chain.push_back(slot);
  };
  while (alive > 1) {
    if (chain.empty()) {
      while (!clusters.alive(start)) ++start;
      push(start);
    }
    clusters.tick(clusters.size());
    const std::uint32_t x = chain.back();
    NearCluster previous;
    if (chain.size() > 1) {
      previous.cluster = chain[chain.size() - 2];
      previous.distance = clusters.distance(x, previous.cluster);
    }
    const NearCluster near = clusters.nearest(x, 0, clusters.size(), previous);
    if (near.cluster != previous.cluster) {
      // Only rounding can lead back into the chain.
      if (chain_position[near.cluster] != kNoCluster) cut(chain_position[near.cluster]);
      push(near.cluster);
      continue;
    }
    cut(chain.size() - 2);
    const auto [low, high] = std::minmax({x, near.cluster});
    Link link = merge_slots(clusters, low, high, near.distance);
    // Otherwise rounding might sort a cluster before its parts.
    link.height = height[high] = std::max({link.height, height[low], height[high]});
    links.push_back(link);
    --alive;
    const std::vector<std::uint32_t> slots = live_slots_if_sparse(clusters, alive);
    if (slots.empty()) continue;
    clusters.move(slots);
    clusters.compact(slots);
    std::vector<std::uint32_t> new_position(slots.size());
    for (std::uint32_t k = 0; k < slots.size(); ++k) {
      height[k] = height[slots[k]];
      new_position[k] = chain_position[slots[k]];
      if (new_position[k] != kNoCluster) chain[new_position[k]] = k;
    }
    chain_position = std::move(new_position);
    start = 0;
  }
  return links;
}

/// Returns all merges in their order, for any distances. Each joins the two nearest clusters, on
/// ties the pair with the lowest slots. Takes O(n^2) distances if each cluster is the nearest of
/// few others, which always holds for positions in space.
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
    const std::vector<std::uint32_t> slots = live_slots_if_sparse(clusters, alive - 1);
    if (slots.empty()) continue;
    std::vector<std::uint32_t> moved(clusters.size(), kNoCluster);
    for (std::uint32_t k = 0; k < slots.size(); ++k) moved[slots[k]] = k;
    clusters.move(slots);
    clusters.compact(slots);
    for (std::uint32_t k = 0; k < slots.size(); ++k) {
      const NearCluster near = nearest[slots[k]];
      nearest[k] = {near.distance, near.cluster == kNoCluster ? kNoCluster : moved[near.cluster]};
    }
    nearest.resize(slots.size());
  }
  return links;
}

}  // namespace terrace::cluster
