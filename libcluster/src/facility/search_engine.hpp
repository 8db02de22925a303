// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "facility/search_state.hpp"
#include "terrace/cluster/facility.hpp"
#include "terrace/cluster/point_search.hpp"
#include "thread_team.hpp"

namespace terrace::cluster {

/// The local search behind PointSearch, for any distances. What depends on the distances is in
/// SpaceSearch.
class SearchEngine {
 public:
  SearchEngine(SearchFrame& frame, unsigned threads);
  virtual ~SearchEngine() = default;

  virtual void start(std::mt19937_64& random) = 0;
  void start(const FacilitySolution& solution);
  double gain(std::uint32_t candidate);
  void open(std::uint32_t candidate);
  bool improve(std::size_t candidates, std::mt19937_64& random, std::size_t batch,
               const std::function<bool(std::size_t, std::size_t)>& progress);
  virtual void assign_nearest() = 0;
  [[nodiscard]] virtual std::size_t wrongly_assigned() const = 0;

  [[nodiscard]] const SearchState& state() const { return state_; }
  [[nodiscard]] const PointSearchStatistics& statistics() const { return statistics_; }

 protected:
  /// Fills in verdict. parallel: the threads of the engine may be used.
  virtual void judge(std::uint32_t candidate, bool parallel, Verdict& verdict) = 0;
  virtual void apply(const Verdict& verdict) = 0;
  [[nodiscard]] virtual double distance(std::uint32_t facility, std::uint32_t client) const = 0;
  virtual void connections_replaced() = 0;
  void replace(std::vector<std::uint32_t> facility, std::vector<double> distance);

  SearchState state_;
  ThreadTeam team_;

 private:
  PointSearchStatistics statistics_;
  std::vector<Verdict> verdicts_;  // of a batch
};

}  // namespace terrace::cluster
