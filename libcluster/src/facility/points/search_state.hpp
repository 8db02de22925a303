// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "facility/points/search_frame.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {

/// The clients of an open facility, in ascending order, and the values that bounds need.
struct Cluster {
  std::vector<std::uint32_t> clients;
  double weight = 0.0;   ///< sum of the clients' weights
  double cost = 0.0;     ///< sum of weighted distances
  double longest = 0.0;  ///< the longest connection, unweighted
};

/// The effect of opening a candidate. Terms are sorted by facility, then client, so sums have the
/// same order whatever strategy found the terms.
struct Verdict {
  struct Taken {
    std::uint64_t key;  ///< current facility * 2^32 + client; kOutlier sorts last
    double spared;
    [[nodiscard]] std::uint32_t facility() const { return static_cast<std::uint32_t>(key >> 32); }
    [[nodiscard]] std::uint32_t client() const { return static_cast<std::uint32_t>(key); }
  };
  struct Closed {
    std::uint32_t facility;
    double spared;
  };
  std::uint32_t candidate = 0;
  double gain = 0.0;
  std::vector<Taken> taken;
  std::vector<Closed> closed;
  std::uint64_t inspected = 0;
  std::vector<double> losses;        ///< working memory
  std::vector<std::uint32_t> stack;  ///< working memory

  void clear() {
    taken.clear();
    closed.clear();
    inspected = 0;
  }
};

/// A solution that is being improved, for any distances. A client that is left out has no facility
/// and a distance equal to the price. No client pays more than the price, and each facility is its
/// own client.
class SearchState {
 public:
  explicit SearchState(SearchFrame& frame);

  [[nodiscard]] std::size_t size() const { return weight_.size(); }
  [[nodiscard]] bool is_open(std::uint32_t i) const { return slot_[i] != kClosed; }
  [[nodiscard]] const Cluster& cluster(std::uint32_t facility) const {
    return clusters_[slot_[facility]];
  }
  /// Returns the number of an open facility, below slot_count(), valid while the facility is open.
  [[nodiscard]] std::uint32_t slot(std::uint32_t facility) const { return slot_[facility]; }
  [[nodiscard]] std::size_t slot_count() const { return clusters_.size(); }
  [[nodiscard]] const std::vector<std::uint32_t>& open() const { return open_; }
  [[nodiscard]] const std::vector<std::uint32_t>& outliers() const { return outliers_; }
  [[nodiscard]] const std::vector<double>& distances() const { return distance_; }
  [[nodiscard]] double distance(std::uint32_t client) const { return distance_[client]; }
  [[nodiscard]] std::uint32_t facility(std::uint32_t client) const { return facility_[client]; }
  [[nodiscard]] double weight(std::uint32_t client) const { return weight_[client]; }
  [[nodiscard]] double facility_cost() const { return facility_cost_; }
  [[nodiscard]] double outlier_price() const { return outlier_price_; }
  [[nodiscard]] double cost() const;
  [[nodiscard]] double unscaled(double cost) const;

  /// Adds up a verdict's terms in their order.
  void sum(Verdict& verdict) const;

  /// Sets a new solution: the facility of each client, or kOutlier, and its distance.
  void assign(std::vector<std::uint32_t> facility, std::vector<double> distance);

  /// Applies a verdict. moved_distance(client) is the distance from the candidate. Sets `changed`
  /// to the clients whose connection changed.
  template <class Distance>
  void apply(const Verdict& verdict, const Distance& moved_distance,
             std::vector<std::uint32_t>& changed);

  [[nodiscard]] FacilitySolution solution() const;

 private:
  static constexpr std::uint32_t kClosed = 0xffffffff;

  void connect(std::uint32_t client, std::uint32_t facility, double distance);
  void open_facility(std::uint32_t facility);
  void close_facility(std::uint32_t facility);
  void keep_own(std::uint32_t facility);
  void sum_up(Cluster& cluster) const;

  std::vector<double> weight_, distance_;
  std::vector<std::uint32_t> facility_;
  double facility_cost_, outlier_price_, true_facility_cost_;
  int cost_exponent_;
  std::vector<std::uint32_t> open_, outliers_;  // in ascending order
  std::vector<std::uint32_t> slot_;             // by facility: index in clusters_
  std::vector<Cluster> clusters_;
  std::vector<std::uint32_t> free_slots_;
};

template <class Distance>
void SearchState::apply(const Verdict& verdict, const Distance& moved_distance,
                        std::vector<std::uint32_t>& changed) {
  const std::uint32_t candidate = verdict.candidate;
  changed.clear();
  const std::uint32_t former = facility_[candidate];
  open_facility(candidate);
  connect(candidate, candidate, 0.0);
  changed.push_back(candidate);
  for (const Verdict::Taken& taken : verdict.taken) {
    if (taken.client() == candidate) continue;
    connect(taken.client(), candidate, moved_distance(taken.client()));
    changed.push_back(taken.client());
  }
  bool left_out = false;
  for (const Verdict::Closed& closed : verdict.closed) {
    for (const std::uint32_t client : clusters_[slot_[closed.facility]].clients) {
      if (facility_[client] != closed.facility) continue;  // the candidate has already taken it
      const double d = moved_distance(client);
      if (d <= outlier_price_) {
        connect(client, candidate, d);
      } else {
        connect(client, kOutlier, outlier_price_);
        outliers_.push_back(client);
        left_out = true;
      }
      changed.push_back(client);
    }
    close_facility(closed.facility);
  }
  // Updates the lists of facilities that lost clients, each once: `taken` is sorted by facility.
  std::uint32_t last = candidate;
  bool outliers_taken = former == kOutlier;
  for (const Verdict::Taken& taken : verdict.taken) {
    const std::uint32_t loser = taken.facility();
    if (loser == kOutlier) {
      outliers_taken = true;
    } else if (loser != last && is_open(loser)) {
      keep_own(loser);
      last = loser;
    }
  }
  if (former != kOutlier && former != candidate && is_open(former)) keep_own(former);
  if (outliers_taken) {
    std::erase_if(outliers_, [&](std::uint32_t i) { return facility_[i] != kOutlier; });
  }
  if (left_out) std::sort(outliers_.begin(), outliers_.end());
  Cluster& own = clusters_[slot_[candidate]];
  for (const std::uint32_t client : changed) {
    if (facility_[client] == candidate) own.clients.push_back(client);
  }
  std::sort(own.clients.begin(), own.clients.end());
  own.clients.erase(std::unique(own.clients.begin(), own.clients.end()), own.clients.end());
  sum_up(own);
}

}  // namespace terrace::cluster
