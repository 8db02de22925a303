// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <terrace/matching/matching_tree.hpp>
#include <terrace/matching/point.hpp>

namespace terrace::tools {

enum class MatchMethod : std::uint8_t { automatic, exact, monotone, monte_carlo };

/// The request of `terrace match`, for points on the ground.
struct MatchRequest {
  MatchMethod method = MatchMethod::automatic;
  std::span<const std::uint32_t> labels{};  ///< the cluster of each point; empty: none given
  std::uint64_t iterations = 0;             ///< of halving; 0: as many as points
  double seconds = 0.0;                     ///< of halving; 0: no limit
  std::uint64_t seed = 1;
  unsigned threads = 1;
  std::uint64_t memory_bytes = 0;
};

/// Called now and then with the work done and the total, in any unit; may throw to stop.
using MatchProgress = std::function<void(std::uint64_t done, std::uint64_t total)>;

struct MatchOutcome {
  std::vector<std::uint32_t> mate;  ///< of each point; matching::kNobody for the one left over
  double cost = 0.0;
  std::uint64_t iterations = 0;       ///< of halving, or rounds of windows
  std::optional<double> lower_bound;  ///< where the method has one
  bool optimal = false;
  std::size_t clusters = 0;  ///< that were matched first; 0: none
};

/// Pairs points. Sets too large to match exactly are first clustered by facility location
/// (`automatic`), unless there are labels.
/// Throws: std::invalid_argument on bad data, std::runtime_error if the memory does not suffice;
/// what `progress` throws.
MatchOutcome run_matching(const MatchRequest& request, std::span<const matching::Point3> points,
                          const MatchProgress& progress);

struct TreeOutcome {
  matching::MatchingTree<matching::Point3> tree;
  std::size_t clusters = 0;  ///< with a tree of their own; 0: none
};

/// The tree of repeated matching, each level by the method of the request. Throws: as above.
TreeOutcome run_matching_tree(const MatchRequest& request, std::span<const matching::Point3> points,
                              const MatchProgress& progress);

}  // namespace terrace::tools
