// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <list>
#include <unordered_map>
#include <utility>
#include <vector>

#include "terrace/tri/view.hpp"

namespace terrace::tri {

/// An LRU cache of delivered clusters, limited in bytes. As a ClusterSource it serves only cached
/// clusters, and the one record set by expect().
class ViewCache final : public ClusterSource {
 public:
  /// counts: number of clusters of each level below the top.
  explicit ViewCache(std::vector<std::uint64_t> counts) : counts_(std::move(counts)) {}
  /// Sets the budget. Must be called before clusters are given. Without it there is no limit.
  void limit(std::size_t max_bytes) { max_bytes_ = max_bytes; }

  /// Drops an earlier version of the cluster, then stores it. Returns false, without storing it, if
  /// it is larger than the budget.
  bool give(LoadedCluster cluster);
  /// Returns null if the cluster is not cached. `use`: marks it as most recently used.
  const LoadedCluster* find(ClusterId cluster, bool use);
  [[nodiscard]] const LoadedCluster* find(ClusterId cluster) const;
  void drop(ClusterId cluster);

  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::size_t max_bytes() const { return max_bytes_; }
  [[nodiscard]] std::size_t size() const { return places_.size(); }
  /// Estimated memory of a cluster with this many members, in bytes, assuming as many attribute
  /// bytes per member as in the cluster given last.
  [[nodiscard]] double bytes_of(unsigned level, std::uint64_t members) const;

  /// Sets the only record that record() can return: the one that the model will request.
  void expect(ClusterId cluster, const ClusterRecord& record) {
    expected_ = cluster;
    record_ = record;
  }
  [[nodiscard]] unsigned top() const override { return static_cast<unsigned>(counts_.size()); }
  [[nodiscard]] std::uint64_t cluster_count(unsigned level) const override {
    return counts_[level];
  }
  ClusterRecord record(ClusterId id) override;
  ClusterMembers read(ClusterId id) override;

 private:
  using Places = std::list<LoadedCluster>;
  void erase(std::unordered_map<ClusterId, Places::iterator>::iterator at);

  std::vector<std::uint64_t> counts_;
  std::size_t max_bytes_ = std::numeric_limits<std::size_t>::max(), bytes_ = 0;
  std::size_t value_bytes_ = 0;  // per member
  Places clusters_;              // least recently used first
  std::unordered_map<ClusterId, Places::iterator> places_;
  ClusterId expected_{};
  ClusterRecord record_;
};

}  // namespace terrace::tri
