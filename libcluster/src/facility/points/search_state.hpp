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

/// A move of the local search: the effect of opening a candidate. Terms are sorted by facility,
/// then client, so the gain is the same to the last bit whichever strategy found the terms.
struct Move {
  struct Reassignment {
    std::uint64_t key;  ///< current facility * 2^32 + client; kOutlier sorts last
    double saving;
    [[nodiscard]] std::uint32_t facility() const { return static_cast<std::uint32_t>(key >> 32); }
    [[nodiscard]] std::uint32_t client() const { return static_cast<std::uint32_t>(key); }
  };
  struct Closing {
    std::uint32_t facility;
    double saving;
  };
  std::uint32_t candidate = 0;
  double gain = 0.0;
  std::vector<Reassignment> reassigned;
  std::vector<Closing> closings;
  std::uint64_t inspected = 0;
  std::vector<double> losses;        ///< working memory
  std::vector<std::uint32_t> stack;  ///< working memory

  void clear() {
    reassigned.clear();
    closings.clear();
    inspected = 0;
  }
};

/// The current solution of a local search. An outlier has no facility, and its distance is the
/// outlier price. No client pays more than the price, and each facility is its own client.
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

  /// Sets move.gain to the sum of its terms, in their order.
  void sum(Move& move) const;

  /// Sets a new solution: the facility of each client, or kOutlier, and its distance.
  void assign(std::vector<std::uint32_t> facility, std::vector<double> distance);

  /// Makes the move. distance_to_candidate(client) is the client's distance from the candidate.
  /// Sets `changed` to the clients whose connection changed.
  template <class Distance>
  void apply(const Move& move, const Distance& distance_to_candidate,
             std::vector<std::uint32_t>& changed);

  [[nodiscard]] FacilitySolution solution() const;

 private:
  static constexpr std::uint32_t kClosed = 0xffffffff;

  void connect(std::uint32_t client, std::uint32_t facility, double distance);
  void open_facility(std::uint32_t facility);
  void close_facility(std::uint32_t facility);
  void remove_lost_clients(std::uint32_t facility);
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
void SearchState::apply(const Move& move, const Distance& distance_to_candidate,
                        std::vector<std::uint32_t>& changed) {
  const std::uint32_t candidate = move.candidate;
  changed.clear();
  const std::uint32_t former = facility_[candidate];
  open_facility(candidate);
  connect(candidate, candidate, 0.0);
  changed.push_back(candidate);
  for (const Move::Reassignment& term : move.reassigned) {
    if (term.client() == candidate) continue;
    connect(term.client(), candidate, distance_to_candidate(term.client()));
    changed.push_back(term.client());
  }
  bool has_new_outliers = false;
  for (const Move::Closing& closing : move.closings) {
    for (const std::uint32_t client : clusters_[slot_[closing.facility]].clients) {
      if (facility_[client] != closing.facility) continue;  // now a client of the candidate
      const double d = distance_to_candidate(client);
      if (d <= outlier_price_) {
        connect(client, candidate, d);
      } else {
        connect(client, kOutlier, outlier_price_);
        outliers_.push_back(client);
        has_new_outliers = true;
      }
      changed.push_back(client);
    }
    close_facility(closing.facility);
  }
  // Updates the lists of facilities that lost clients, each once: `reassigned` is sorted by
  // facility.
  std::uint32_t last = candidate;
  bool outliers_changed = former == kOutlier;
  for (const Move::Reassignment& term : move.reassigned) {
    const std::uint32_t loser = term.facility();
    if (loser == kOutlier) {
      outliers_changed = true;
    } else if (loser != last && is_open(loser)) {
      remove_lost_clients(loser);
      last = loser;
    }
  }
  if (former != kOutlier && former != candidate && is_open(former)) remove_lost_clients(former);
  if (outliers_changed) {
    std::erase_if(outliers_, [&](std::uint32_t i) { return facility_[i] != kOutlier; });
  }
  if (has_new_outliers) std::sort(outliers_.begin(), outliers_.end());
  Cluster& own = clusters_[slot_[candidate]];
  for (const std::uint32_t client : changed) {
    if (facility_[client] == candidate) own.clients.push_back(client);
  }
  std::sort(own.clients.begin(), own.clients.end());
  own.clients.erase(std::unique(own.clients.begin(), own.clients.end()), own.clients.end());
  sum_up(own);
}

}  // namespace terrace::cluster
