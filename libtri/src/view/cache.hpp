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

/// Given clusters within a budget of bytes; what was not used for the longest time goes first. As
/// a source it delivers what is there and never waits.
class ViewCache final : public ClusterSource {
 public:
  /// counts: clusters of each level below the top.
  explicit ViewCache(std::vector<std::uint64_t> counts) : counts_(std::move(counts)) {}
  /// No budget until this is called, before clusters are given.
  void limit(std::size_t max_bytes) { max_bytes_ = max_bytes; }

  /// Takes the place of an earlier one. False if it is larger than the budget: it is not kept then.
  bool give(GivenCluster cluster);
  /// Null if it is not there. `use`: it goes last from now on.
  const GivenCluster* find(ClusterId cluster, bool use);
  void drop(ClusterId cluster);

  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::size_t max_bytes() const { return max_bytes_; }
  [[nodiscard]] std::size_t size() const { return places_.size(); }
  /// What a cluster with this many members takes.
  [[nodiscard]] static double bytes_of(unsigned level, std::uint64_t members);

  /// Makes the record known that the model will ask for.
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
  Places clusters_;  // the longest unused first
  std::unordered_map<ClusterId, Places::iterator> places_;
  ClusterId expected_{};
  ClusterRecord record_;
};

}  // namespace terrace::tri
