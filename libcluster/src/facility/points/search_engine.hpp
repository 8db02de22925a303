// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include <terrace/base/stop_check.hpp>
#include <terrace/base/thread_team.hpp>

#include "facility/points/search_state.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {

/// The local search, one step at a time. SpaceSearch implements the part that depends on the kind
/// of distances. Initially client 0 is the only open facility. Costs and gains are in the unit of
/// the problem.
///
/// Invariant: cost() before open(p) minus cost() after it equals gain(p), whatever its sign, up to
/// rounding.
class SearchEngine {
 public:
  /// strategy: one of local search, not automatic.
  /// threads: 0 means one per core.
  /// check_stop: called by every operation of O(clients) or more, which throws whatever it throws.
  SearchEngine(SearchFrame& frame, FacilityStrategy strategy, unsigned threads,
               base::StopCheck check_stop);
  virtual ~SearchEngine() = default;

  /// Starts from Meyerson's solution (4.2.3). In random order, each client opens a facility with
  /// probability w d / fc, where d is the distance to the nearest facility so far. Otherwise it
  /// joins that facility, or becomes an outlier if that is cheaper. Takes O(clients * facilities).
  virtual void start(std::mt19937_64& random) = 0;
  /// Starts from a solution. Throws: std::invalid_argument if it is not a solution of the problem.
  void start(const FacilitySolution& solution);

  /// Returns the saving from opening `candidate`. It takes the clients that are nearer to it than
  /// to their facility, and all clients of facilities that are then not worth keeping. An open
  /// facility can be a candidate too; opening it costs nothing.
  [[nodiscard]] double gain(std::uint32_t candidate);
  /// Makes the change that gain() evaluated.
  void open(std::uint32_t candidate);
  /// Tries random candidates as FacilityOptions::batch and ::progress say. Returns false if
  /// stopped.
  bool improve(std::size_t candidates, std::mt19937_64& random, std::size_t batch = 1,
               const FacilityProgress& progress = {});

  /// Connects each client to its nearest open facility; on ties to the current one, or otherwise to
  /// the one with the lowest number. Leaves out clients if their price is lower. The cost does not
  /// rise.
  virtual void assign_nearest() = 0;
  /// Returns the number of clients for which another open facility, or the outlier price, would be
  /// better. Takes O(clients * facilities).
  [[nodiscard]] virtual std::size_t wrongly_assigned() const = 0;

  [[nodiscard]] FacilityStrategy strategy() const { return strategy_; }
  [[nodiscard]] std::size_t size() const { return state_.size(); }  ///< clients
  [[nodiscard]] std::size_t facility_count() const { return state_.open().size(); }
  [[nodiscard]] double cost() const { return state_.unscaled(state_.cost()); }
  [[nodiscard]] FacilitySolution solution() const { return state_.solution(); }
  /// Returns statistics since construction. wrongly_assigned stays 0.
  [[nodiscard]] const SearchStatistics& statistics() const { return statistics_; }

 protected:
  /// Fills in `move`, the effect of opening the candidate. parallel: whether to use the engine's
  /// threads.
  virtual void evaluate(std::uint32_t candidate, bool parallel, Move& move) = 0;
  virtual void apply(const Move& move) = 0;
  [[nodiscard]] virtual double distance(std::uint32_t facility, std::uint32_t client) const = 0;
  virtual void connections_replaced() = 0;
  void replace(std::vector<std::uint32_t> facility, std::vector<double> distance);

  const FacilityStrategy strategy_;
  SearchState state_;
  base::ThreadTeam team_;
  const base::StopCheck check_stop_;

 private:
  SearchStatistics statistics_;
  std::vector<Move> moves_;  // of a batch
};

}  // namespace terrace::cluster
