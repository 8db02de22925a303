// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <list>
#include <optional>
#include <unordered_map>
#include <vector>

#include <terrace/stream/store.hpp>

#include "surface/store_window.hpp"

namespace terrace::terrain {

/// What the index of a store tells of the points in a box, without their being read: about how many
/// there are and between which heights. Clusters that lie in the box as a whole count as a whole;
/// of those on its border the ones of level 0 do, by the share of their boxes inside.
///
/// One object per thread; any number of them share a Store. All functions throw stream::Error on a
/// damaged store.
class ClusterCensus {
 public:
  explicit ClusterCensus(const stream::Store& store);
  ClusterCensus(const ClusterCensus&) = delete;
  ClusterCensus& operator=(const ClusterCensus&) = delete;

  /// About the number of points in the box. Above `limit` any number above it: then it ends early.
  double count(const StoredBox& box, double limit);

  struct Heights {
    double low = 0.0, high = 0.0;  ///< stored; of the clusters counted
    /// A few of the points in the box, if it came upon some.
    std::vector<stream::Point3> some;
  };
  /// Nothing if no cluster meets the box.
  std::optional<Heights> heights(const StoredBox& box);

 private:
  /// A cluster that a point heads.
  struct Entry {
    stream::Box3 box;
    std::uint64_t ordinal = 0, descendants = 0;
  };
  /// The members of a cluster above level 0, each with the clusters that it heads, level 0 first.
  struct Node {
    stream::ClusterId id{};
    std::vector<stream::Point3> positions;
    std::vector<Entry> entries;

    [[nodiscard]] std::size_t bytes() const {
      return positions.capacity() * sizeof(stream::Point3) + entries.capacity() * sizeof(Entry) +
             sizeof(Node) + 64;
    }
  };
  using Nodes = std::list<Node>;

  void fill(Node& node, stream::ClusterId id);
  const Node& node(stream::ClusterId id);
  /// Calls take(head, cluster) for those that count, until it returns false; before it opens one
  /// that lies on the border it asks open(cluster).
  template <class Take, class Opens>
  void walk(const StoredBox& box, const Take& take, const Opens& opens);

  const stream::Store& store_;
  Node root_;
  Nodes nodes_;  ///< the one used last in front
  std::unordered_map<std::uint64_t, Nodes::iterator> by_id_;
  std::size_t held_bytes_ = 0;
  stream::ClusterPoints points_;
  std::vector<stream::ClusterId> open_;
};

}  // namespace terrace::terrain
