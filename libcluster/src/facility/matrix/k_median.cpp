// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/k_median.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <queue>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <terrace/base/parallel.hpp>
#include <terrace/base/random.hpp>

#include "facility/bounds/matrix_dual.hpp"
#include "facility/matrix/cost_rows.hpp"
#include "facility/matrix/matrix_search.hpp"
#include "facility/matrix/nearest_open.hpp"
#include "facility/points/point_space.hpp"

namespace terrace::cluster {
namespace {

constexpr double kMinSwapGain = 1e-12;  // fraction of the cost; smaller gains are rounding
constexpr std::size_t kBatch = 32;      // number of swaps evaluated on the same solution
// A batch with at least this many costs is worth a thread.
constexpr std::size_t kWorthThreads = 200000;

/// A solution of k facilities that is improved by swaps.
class MedianSearch {
 public:
  /// threads: number of threads that evaluate swaps concurrently.
  MedianSearch(const CostRows& costs, unsigned threads);

  void reset(std::span<const std::uint32_t> open);
  /// Opens those of `candidates` that save most, or closes those that cost least to close, until k
  /// are open. Requires: enough candidates.
  void open_exactly(std::size_t k, std::span<const std::uint32_t> candidates);
  /// Swaps facilities until none helps.
  void descend(std::mt19937_64& random);
  /// Replaces `count` random facilities by random others.
  void replace(std::size_t count, std::mt19937_64& random);

  [[nodiscard]] double cost() const { return state_.connection_cost(); }
  /// Returns the open facilities in ascending order.
  [[nodiscard]] std::vector<std::uint32_t> open() const;

 private:
  struct Swap {
    double gain = 0.0;
    std::uint32_t leaving = NearestOpen::kNone;
  };
  struct Work {
    std::vector<double> closing, scratch;
  };
  [[nodiscard]] Swap judge(std::uint32_t candidate, Work& work) const;
  [[nodiscard]] double opening_gain(std::uint32_t candidate);
  void close_least();

  const CostRows* costs_;
  unsigned threads_;
  NearestOpen state_;
  std::vector<Work> work_;
  std::vector<std::uint32_t> order_;
};

MedianSearch::MedianSearch(const CostRows& costs, unsigned threads)
    : costs_(&costs),
      threads_(kBatch * costs.clients() >= kWorthThreads ? threads : 1),
      state_(costs),
      work_(kBatch) {
  order_.resize(costs.facilities());
  std::iota(order_.begin(), order_.end(), 0u);
}

void MedianSearch::reset(std::span<const std::uint32_t> open) { state_.reset(open); }

std::vector<std::uint32_t> MedianSearch::open() const {
  std::vector<std::uint32_t> result(state_.facilities().begin(), state_.facilities().end());
  std::sort(result.begin(), result.end());
  return result;
}

double MedianSearch::opening_gain(std::uint32_t candidate) {
  const double* const costs = costs_->row(candidate, work_[0].scratch);
  const double* const first = state_.first_cost().data();
  double gain = 0.0;
  for (std::size_t i = 0, n = costs_->clients(); i < n; ++i) {
    gain += std::max(0.0, first[i] - costs[i]);
  }
  return gain;
}

void MedianSearch::close_least() {
  std::vector<double>& closing = work_[0].closing;
  closing.resize(costs_->facilities());
  for (const std::uint32_t j : state_.facilities()) closing[j] = 0.0;
  for (std::size_t i = 0, n = costs_->clients(); i < n; ++i) {
    closing[state_.first()[i]] += state_.second_cost()[i] - state_.first_cost()[i];
  }
  state_.close(*std::min_element(state_.facilities().begin(), state_.facilities().end(),
                                 [&](std::uint32_t a, std::uint32_t b) {
                                   return closing[a] < closing[b] ||
                                          (closing[a] == closing[b] && a > b);
                                 }));
}

void MedianSearch::open_exactly(std::size_t k, std::span<const std::uint32_t> candidates) {
  while (state_.facilities().size() > k) close_least();
  if (state_.facilities().size() == k) return;
  // Gains only decrease as other facilities open, so an old gain is an upper bound.
  struct Entry {
    double gain;
    std::uint32_t facility;
    bool operator<(const Entry& other) const {
      return gain < other.gain || (gain == other.gain && facility > other.facility);
    }
  };
  std::priority_queue<Entry> queue;
  for (const std::uint32_t j : candidates) {
    if (!state_.is_open(j)) queue.push({opening_gain(j), j});
  }
  while (state_.facilities().size() < k) {
    assert(!queue.empty());
    Entry best = queue.top();
    queue.pop();
    best.gain = opening_gain(best.facility);
    if (!queue.empty() && best < queue.top()) {
      queue.push(best);
    } else {
      state_.open(best.facility);
    }
  }
}

MedianSearch::Swap MedianSearch::judge(std::uint32_t candidate, Work& work) const {
  work.closing.resize(costs_->facilities());
  for (const std::uint32_t j : state_.facilities()) work.closing[j] = 0.0;
  const double* const costs = costs_->row(candidate, work.scratch);
  const double* const first = state_.first_cost().data();
  const double* const second = state_.second_cost().data();
  const std::uint32_t* const facility = state_.first().data();
  double gain = 0.0;
  for (std::size_t i = 0, n = costs_->clients(); i < n; ++i) {
    const double now = std::min(costs[i], first[i]);
    gain += first[i] - now;
    work.closing[facility[i]] += std::min(costs[i], second[i]) - now;
  }
  Swap best{-1.0, NearestOpen::kNone};
  for (const std::uint32_t j : state_.facilities()) {
    const double saving = gain - work.closing[j];
    if (best.leaving == NearestOpen::kNone || saving > best.gain) best = {saving, j};
  }
  return best;
}

void MedianSearch::descend(std::mt19937_64& random) {
  base::shuffle(order_, random);
  std::vector<Swap> swaps(kBatch);
  std::vector<std::uint32_t> batch;
  // Ends when every candidate has been rejected since the last swap.
  std::size_t refused = 0;
  for (std::size_t at = 0; refused < order_.size();) {
    batch.clear();
    std::size_t looked = 0;
    while (batch.size() < kBatch && refused + looked < order_.size()) {
      const std::uint32_t candidate = order_[(at + looked++) % order_.size()];
      if (!state_.is_open(candidate)) batch.push_back(candidate);
    }
    base::parallel_for(batch.size(), threads_,
                       [&](std::size_t b) { swaps[b] = judge(batch[b], work_[b]); });
    std::size_t best = 0;
    for (std::size_t b = 1; b < batch.size(); ++b) {
      if (swaps[b].gain > swaps[best].gain) best = b;
    }
    if (!batch.empty() && swaps[best].gain > kMinSwapGain * cost()) {
      state_.open(batch[best]);
      state_.close(swaps[best].leaving);
      refused = 0;  // the batch is repeated, because others in it may still be good
    } else {
      refused += looked;
      at = (at + looked) % order_.size();
    }
  }
}

void MedianSearch::replace(std::size_t count, std::mt19937_64& random) {
  for (std::size_t s = 0; s < count; ++s) {
    const std::uint32_t candidate = base::draw_below(costs_->facilities(), random);
    if (state_.is_open(candidate)) continue;
    const auto facilities = state_.facilities();
    const std::uint32_t leaving = facilities[base::draw_below(facilities.size(), random)];
    state_.open(candidate);
    state_.close(leaving);
  }
}

// Solves facility location with one opening cost for all, repeatedly, each time from the last
// solution, until k are open or the costs are adjacent doubles. Returns the solution whose number
// of facilities is closest to k.
std::vector<std::uint32_t> search_for_cost(const CostRows& costs, std::size_t k,
                                           const std::vector<std::uint32_t>& candidates,
                                           std::mt19937_64& random) {
  constexpr unsigned kProbes = 20;
  std::vector<double> opening(costs.facilities(), 0.0);
  MatrixSearch search(costs, opening, candidates);
  search.reset(std::span(candidates).first(1));
  const double all = search.cost();
  std::vector<std::uint32_t> nearest(1, candidates[0]);
  double low = 0.0, high = all, cost = all / (2.0 * static_cast<double>(k));
  const auto off = [k](std::size_t count) { return count > k ? count - k : k - count; };
  for (unsigned probe = 0; probe < kProbes && off(nearest.size()) > 0 && cost > 0.0; ++probe) {
    std::fill(opening.begin(), opening.end(), cost);
    search.reprice();
    search.descend(random);
    const auto open = search.state().facilities();
    if (off(open.size()) < off(nearest.size())) nearest.assign(open.begin(), open.end());
    (open.size() > k ? low : high) = cost;
    if (low > 0.0 && high < 1.002 * low) break;
    cost = low > 0.0 ? std::sqrt(low) * std::sqrt(high) : cost / 8.0;
  }
  return nearest;
}

/// Returns the best facilities of all restarts, ascending. Requires: 0 < k <= facilities, restarts
/// > 0.
std::vector<std::uint32_t> find_medians(const CostRows& costs, std::size_t k,
                                        const KMedianOptions& options) {
  constexpr std::size_t kAll = 1000;  // with up to this many facilities, all are candidates
  std::mt19937_64 random(base::seed_of_run(options.seed, 0));
  std::vector<std::uint32_t> candidates(costs.facilities());
  std::iota(candidates.begin(), candidates.end(), 0u);
  base::shuffle(candidates, random);
  if (candidates.size() > kAll) {
    candidates.resize(std::min(candidates.size(), std::max<std::size_t>(kAll / 2, 4 * k)));
  }
  MedianSearch first(costs, options.threads);
  first.reset(search_for_cost(costs, k, candidates, random));
  first.open_exactly(k, candidates);
  const std::vector<std::uint32_t> start = first.open();

  std::vector<double> cost(options.restarts);
  std::vector<std::vector<std::uint32_t>> solutions(options.restarts);
  base::parallel_for(options.restarts, options.threads, [&](std::size_t run) {
    std::mt19937_64 draws(base::seed_of_run(options.seed, run + 1));
    MedianSearch search(costs, options.restarts > 1 ? 1 : options.threads);
    search.reset(start);
    if (run > 0) search.replace(std::max<std::size_t>(1, k / 2), draws);
    search.descend(draws);
    cost[run] = search.cost();
    solutions[run] = search.open();
  });
  return solutions[static_cast<std::size_t>(std::min_element(cost.begin(), cost.end()) -
                                            cost.begin())];
}

void check_count(std::size_t k, std::size_t facilities, const KMedianOptions& options) {
  if (k == 0) throw std::invalid_argument("k-median with k = 0: give at least 1");
  if (k > facilities) {
    throw std::invalid_argument("k-median with k = " + std::to_string(k) + ", but there are only " +
                                std::to_string(facilities) + " places: give at most that many");
  }
  if (options.restarts == 0) {
    throw std::invalid_argument("restarts is 0: give at least 1");
  }
}

struct Connections {
  std::vector<std::uint32_t> nearest;  // position in the list of facilities, the first on ties
  std::vector<double> cost;
  std::vector<double> second;
};

Connections connect(const CostRows& costs, std::span<const std::uint32_t> facilities) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::size_t n = costs.clients();
  Connections result{std::vector<std::uint32_t>(n, 0), std::vector<double>(n, kInfinity),
                     std::vector<double>(n, kInfinity)};
  std::vector<double> scratch;
  for (std::uint32_t k = 0; k < facilities.size(); ++k) {
    const double* const row = costs.row(facilities[k], scratch);
    for (std::size_t i = 0; i < n; ++i) {
      if (row[i] < result.cost[i]) {
        result.second[i] = result.cost[i];
        result.cost[i] = row[i];
        result.nearest[i] = k;
      } else {
        result.second[i] = std::min(result.second[i], row[i]);
      }
    }
  }
  return result;
}

// Starts the duals from what each client would pay for its second facility.
double bound(const CostRows& costs, const Connections& connections, std::size_t k,
             const KMedianOptions& options) {
  if (options.bound_steps == 0) return 0.0;
  double cost = 0.0;
  std::vector<double> duals(costs.clients());
  for (std::size_t i = 0; i < duals.size(); ++i) {
    cost += connections.cost[i];
    duals[i] = std::isfinite(connections.second[i]) ? connections.second[i] : connections.cost[i];
  }
  MedianDual function(costs, k, options.threads);
  return std::max(0.0, ascend(function, duals, cost, {.steps = options.bound_steps}));
}

}  // namespace

FacilitySolution k_median(const FacilityMatrix& problem, std::size_t k,
                          const KMedianOptions& options) {
  check(problem, options.check_stop);
  check_count(k, problem.facilities, options);
  const MatrixRows costs(problem, options.check_stop);
  FacilitySolution solution;
  solution.facilities = find_medians(costs, k, options);
  const Connections connections = connect(costs, solution.facilities);
  solution.assignment = connections.nearest;
  for (std::size_t i = 0; i < problem.clients; ++i) {
    solution.connection_cost += problem.cost(solution.facilities[solution.assignment[i]], i);
  }
  solution.lower_bound = costs.unscaled(bound(costs, connections, k, options));
  return solution;
}

FacilitySolution k_median(const FacilityPoints& problem, std::size_t k,
                          const KMedianOptions& options) {
  check(problem);
  check_count(k, problem.points.size(), options);
  SearchFrame frame = make_frame(problem);
  const double rounding = rounding_of_frame(problem, frame);
  return visit_space(problem, frame, problem.points, [&](const auto& space) {
    const PointRows costs(space, frame.weights, frame.outlier_price, options.check_stop);
    FacilitySolution solution;
    solution.facilities = find_medians(costs, k, options);
    Connections connections = connect(costs, solution.facilities);
    solution.assignment = connections.nearest;
    for (std::uint32_t c = 0; c < k; ++c) solution.assignment[solution.facilities[c]] = c;
    for (std::uint32_t i = 0; i < problem.points.size(); ++i) {
      const double d = space.row(solution.facilities[solution.assignment[i]])(i);
      if (d > frame.outlier_price) {
        solution.assignment[i] = kOutlier;
        solution.outlier_cost += frame.weights[i] * frame.outlier_price;
      } else {
        solution.connection_cost += frame.weights[i] * d;
      }
    }
    const auto unscaled = [&](double cost) { return std::ldexp(cost, frame.cost_exponent); };
    solution.connection_cost = unscaled(solution.connection_cost);
    solution.outlier_cost = unscaled(solution.outlier_cost);
    solution.lower_bound =
        unscaled(std::max(0.0, bound(costs, connections, k, options) - rounding));
    return solution;
  });
}

}  // namespace terrace::cluster
