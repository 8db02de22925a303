// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>

#include "surface/store_window.hpp"
#include "surface/wanted_clusters.hpp"

namespace terrace::terrain {

/// An incremental descent into a store's clusters. Knows the boxes of all wanted clusters that have
/// not been read. Outside the boxes of open(), all points are known.
class ClusterFrontier {
 public:
  /// A cluster that has not been read; its box also contains all points below it.
  struct Open {
    StoredBox box;
    std::uint32_t entry = 0;  ///< index for ClusterFrontier
    std::uint8_t level = 0;
    std::uint8_t lowest = 0;  ///< lowest level on which its head's cluster is wanted
  };
  /// Receives the members of a cluster.
  using Take = std::function<void(const stream::StoreQuery::Node& node)>;

  /// Descends into wanted clusters only. The store must outlive this object.
  ClusterFrontier(const stream::Store& store, const WantedClusters& wanted);

  /// Clears the state and reads the root.
  void begin(const Take& take);
  [[nodiscard]] std::span<const Open> open() const { return open_; }
  /// Reads all clusters that meet the box, and their descendants that do.
  void read_meeting(const StoredBox& box, const Take& take);
  /// Reads some clusters of open() without their descendants. `chosen`: distinct indices in open(),
  /// ascending. Changes open().
  void read(std::span<const std::uint32_t> chosen, const Take& take);

  [[nodiscard]] std::size_t memory_bytes() const {
    return entries_.capacity() * sizeof(Entry) + open_.capacity() * sizeof(Open);
  }

 private:
  /// A cluster headed by a point. Entries of one point are consecutive, the lowest level first.
  struct Entry {
    StoredBox box;
    std::uint64_t ordinal = 0;
  };

  void read_one(std::size_t at, const Take& take);
  void add_below(const stream::StoreQuery::Node& node);
  /// Skips boxes of a single point, except in views: all points below have the x and y of the head,
  /// and the head determines the height. Returns false if no box is left.
  bool settle(Open& open) const;

  stream::StoreQuery reader_;
  stream::ClusterId root_;
  WantedClusters wanted_;
  bool skips_none_;
  std::vector<Entry> entries_;
  std::vector<Open> open_;
};

}  // namespace terrace::terrain
