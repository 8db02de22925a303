// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/match_run.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include <terrace/cluster/hierarchy.hpp>
#include <terrace/matching/halving.hpp>
#include <terrace/matching/large_matching.hpp>
#include <terrace/matching/point_matching.hpp>

#include "base/units.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

using matching::Point3;

/// Size of the clusters that are matched first in large sets.
constexpr double kClusterSize = 10000;
/// Memory of an exact matching per point, measured.
constexpr std::uint64_t kExactBytes = 800;
/// Memory of windows per point, besides those at work.
constexpr std::uint64_t kWindowBytes = 150;

std::size_t exact_limit() { return matching::LargeMatchingOptions{}.exact_limit; }

void check_memory(std::uint64_t needed, const MatchRequest& request, std::size_t points,
                  const char* remedy) {
  if (request.memory_bytes == 0 || needed <= request.memory_bytes) return;
  throw std::runtime_error("matching " + with_commas(points) + " points takes about " +
                           readable_bytes(needed) + " and --memory is " +
                           readable_bytes(request.memory_bytes) + ": " + remedy);
}

std::size_t distinct(std::span<const std::uint32_t> labels) {
  std::vector<std::uint32_t> sorted(labels.begin(), labels.end());
  std::sort(sorted.begin(), sorted.end());
  return static_cast<std::size_t>(std::unique(sorted.begin(), sorted.end()) - sorted.begin());
}

matching::HalvingOptions halving_options(const MatchRequest& request) {
  matching::HalvingOptions options;
  options.method = request.method == MatchMethod::monotone ? matching::Halving::monotone
                                                           : matching::Halving::monte_carlo;
  options.iterations = request.iterations;
  if (request.seconds > 0) options.seconds = request.seconds;
  options.seed = request.seed;
  options.threads = request.threads;
  options.memory_limit = request.memory_bytes;
  return options;
}

bool halves(MatchMethod method) {
  return method == MatchMethod::monotone || method == MatchMethod::monte_carlo;
}

/// The clusters that are matched first: the caller's, or by facility location if there are too many
/// points to match at once.
std::vector<std::uint32_t> clusters_of(const MatchRequest& request, std::span<const Point3> points,
                                       const MatchProgress& progress) {
  if (!request.labels.empty()) return {request.labels.begin(), request.labels.end()};
  if (request.method != MatchMethod::automatic || points.size() <= exact_limit()) return {};
  return cluster::clusters_of_size(points, kClusterSize, request.seed, request.threads,
                                   [&](std::uint64_t done) { progress(done, points.size()); });
}

MatchOutcome halve(const MatchRequest& request, std::span<const Point3> points,
                   const MatchProgress& progress) {
  matching::HalvingOptions options = halving_options(request);
  options.progress = [&](std::uint64_t done, std::uint64_t total, double) {
    progress(done, total);
    return true;
  };
  matching::HalvingMatching matching = matching::match_by_halving(points, options);
  MatchOutcome outcome;
  outcome.mate = std::move(matching.mate);
  outcome.cost = matching.cost;
  outcome.iterations = matching.iterations;
  return outcome;
}

}  // namespace

MatchOutcome run_matching(const MatchRequest& request, std::span<const Point3> points,
                          const MatchProgress& progress) {
  if (halves(request.method)) return halve(request, points, progress);
  const std::vector<std::uint32_t> labels = clusters_of(request, points, progress);
  matching::LargeMatchingOptions options;
  if (request.method == MatchMethod::exact) options.exact_limit = points.size();
  const bool exact = labels.empty();
  if (exact) {
    check_memory(kExactBytes * points.size(), request, points.size(),
                 "raise it, or name clusters with --labels");
  } else {
    check_memory(kWindowBytes * points.size() + kExactBytes * options.window * request.threads,
                 request, points.size(), "raise it, or take fewer --threads");
  }
  options.labels = labels;
  options.threads = request.threads;
  options.progress = [&](std::uint64_t done, std::uint64_t total, double) {
    progress(done, total);
    return true;
  };
  matching::LargeMatching matching = matching::match_large(points, options);
  MatchOutcome outcome;
  outcome.mate = std::move(matching.mate);
  outcome.cost = matching.cost;
  outcome.iterations = matching.rounds;
  outcome.lower_bound = matching.dual_bound;
  outcome.optimal = matching.optimal;
  outcome.clusters = exact ? 0 : distinct(labels);
  return outcome;
}

TreeOutcome run_matching_tree(const MatchRequest& request, std::span<const Point3> points,
                              const MatchProgress& progress) {
  const std::vector<std::uint32_t> labels = clusters_of(request, points, progress);
  matching::MatchingTreeOptions<Point3> options;
  options.labels = labels;
  options.threads = request.threads;
  options.memory_limit = request.memory_bytes;
  if (halves(request.method)) {
    options.matcher = [&](std::span<const Point3> nodes) {
      matching::HalvingOptions halving = halving_options(request);
      // Clusters are matched in parallel already.
      if (!labels.empty()) halving.threads = 1;
      return std::move(matching::match_by_halving(nodes, halving).mate);
    };
  } else if (request.method == MatchMethod::exact) {
    options.matcher = [](std::span<const Point3> nodes) {
      return std::move(matching::match_points(nodes).mate);
    };
  }
  // The tree, and the level being matched.
  const std::uint64_t tree_bytes = 120 * points.size();
  check_memory(labels.empty() ? tree_bytes + kExactBytes * points.size() : tree_bytes, request,
               points.size(), "raise it, or name clusters with --labels");
  options.progress = [&](std::size_t done, std::size_t total) {
    progress(done, total);
    return true;
  };
  return {matching::make_matching_tree(points, options), labels.empty() ? 0 : distinct(labels)};
}

}  // namespace terrace::tools
