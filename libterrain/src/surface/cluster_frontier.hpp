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

namespace terrace::terrain {

/// The way down into a store's clusters, step by step: which have been read, and the boxes of all
/// that have not. Where no box of open() reaches, no point is missing.
class ClusterFrontier {
 public:
  /// A cluster that was not read; its box holds all points below it too.
  struct Open {
    StoredBox box;
    std::uint32_t entry = 0;  ///< for ClusterFrontier
    std::uint8_t level = 0;
  };
  /// Takes the members of a cluster.
  using Take = std::function<void(const stream::StoreQuery::Node& node)>;

  /// level: the points of this level and above. The store must outlive this.
  ClusterFrontier(const stream::Store& store, unsigned level);

  /// Forgets what was read and reads the root.
  void begin(const Take& take);
  [[nodiscard]] std::span<const Open> open() const { return open_; }
  /// Reads what meets the box, and what meets it below that.
  void read_meeting(const StoredBox& box, const Take& take);
  /// Reads some of open() without what is below. `chosen`: places in open(), ascending, all
  /// different. open() is then another.
  void read(std::span<const std::uint32_t> chosen, const Take& take);

  [[nodiscard]] std::size_t memory_bytes() const {
    return entries_.capacity() * sizeof(Entry) + open_.capacity() * sizeof(Open);
  }

 private:
  /// A cluster that a point heads. Those of one point stand in a row, the lowest level first.
  struct Entry {
    StoredBox box;
    std::uint64_t ordinal = 0;
  };

  void read_one(std::size_t at, const Take& take);
  void add_below(const stream::StoreQuery::Node& node);
  /// Skips boxes that are one point: all below has the x,y of the head, which counts, but for
  /// views. False if none is left.
  bool settle(Open& open) const;

  stream::StoreQuery reader_;
  stream::ClusterId root_;
  unsigned level_;
  bool skips_none_;
  std::vector<Entry> entries_;
  std::vector<Open> open_;
};

}  // namespace terrace::terrain
