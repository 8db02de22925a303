// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "facility/matrix/cost_rows.hpp"
#include "facility/matrix/nearest_open.hpp"
#include "terrace/cluster/k_median.hpp"

namespace terrace::cluster {

/// A solution of k facilities that is improved by exchanges.
class MedianSearch {
 public:
  /// threads: number of threads that evaluate exchanges concurrently.
  MedianSearch(const CostRows& costs, unsigned threads);

  void reset(std::span<const std::uint32_t> open);
  /// Opens those of `candidates` that save most, or closes those that cost least to close, until k
  /// are open. Requires: enough candidates.
  void bring_to(std::size_t k, std::span<const std::uint32_t> candidates);
  /// Exchanges facilities until none helps.
  void descend(std::mt19937_64& random);
  /// Replaces `count` random facilities by random others.
  void replace(std::size_t count, std::mt19937_64& random);

  [[nodiscard]] double cost() const { return state_.connection_cost(); }
  /// Returns the open facilities in ascending order.
  [[nodiscard]] std::vector<std::uint32_t> open() const;

 private:
  struct Exchange {
    double gain = 0.0;
    std::uint32_t leaving = NearestOpen::kNone;
  };
  struct Work {
    std::vector<double> closing, scratch;
  };
  [[nodiscard]] Exchange judge(std::uint32_t candidate, Work& work) const;
  [[nodiscard]] double opening_gain(std::uint32_t candidate);
  void close_least();

  const CostRows* costs_;
  unsigned threads_;
  NearestOpen state_;
  std::vector<Work> work_;
  std::vector<std::uint32_t> order_;
};

/// Returns the best facilities of all restarts, ascending. Requires: 0 < k <= facilities, restarts
/// > 0.
[[nodiscard]] std::vector<std::uint32_t> find_medians(const CostRows& costs, std::size_t k,
                                                      const KMedianOptions& options);

}  // namespace terrace::cluster
