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

/// An LRU cache of given clusters within a budget of bytes. As a source it delivers what it holds
/// and never waits.
class ViewCache final : public ClusterSource {
 public:
  /// counts: clusters of each level below the top.
  explicit ViewCache(std::vector<std::uint64_t> counts) : counts_(std::move(counts)) {}
  /// There is no budget until this is called, before clusters are given.
  void limit(std::size_t max_bytes) { max_bytes_ = max_bytes; }

  /// Replaces an earlier version. Returns false if it is larger than the budget: then it is not
  /// kept.
  bool give(GivenCluster cluster);
  /// Null if it is not cached. `use`: marks it as most recently used.
  const GivenCluster* find(ClusterId cluster, bool use);
  [[nodiscard]] const GivenCluster* find(ClusterId cluster) const;
  void drop(ClusterId cluster);

  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::size_t max_bytes() const { return max_bytes_; }
  [[nodiscard]] std::size_t size() const { return places_.size(); }
  /// Memory of a cluster with this many members, each with as many values as in the last given.
  [[nodiscard]] double bytes_of(unsigned level, std::uint64_t members) const;

  /// Provides the record that the model will request.
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
  using Places = std::list<GivenCluster>;
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
