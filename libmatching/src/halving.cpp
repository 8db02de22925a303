// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/halving.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include <terrace/base/parallel.hpp>
#include <terrace/base/random.hpp>
#include <terrace/base/stop_check.hpp>
#include <unistd.h>

#include "terrace/matching/assignment.hpp"

namespace terrace::matching {
namespace {

/// Writes the distances from one point to several others.
using Row = std::function<void(std::uint32_t from, std::span<const std::uint32_t> to, double* out)>;

/// Two halves of the points. The second has one point more if their number is odd.
struct Halves {
  std::vector<std::uint32_t> first, second;
};

/// Divides the points at random.
Halves random_halves(std::uint32_t count, std::mt19937_64& random) {
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  for (std::uint32_t i = count; i > 1; --i)
    std::swap(order[i - 1], order[base::draw_below(i, random)]);
  const auto middle = order.begin() + count / 2;
  return {{order.begin(), middle}, {middle, order.end()}};
}

/// Puts the two points of each pair into different halves at random.
Halves separate_pairs(const std::vector<std::uint32_t>& mate, std::mt19937_64& random) {
  Halves halves;
  for (std::uint32_t i = 0; i < mate.size(); ++i) {
    if (mate[i] == kNone) {
      halves.second.push_back(i);
    } else if (i < mate[i]) {
      const bool swapped = (random() & 1u) != 0;
      halves.first.push_back(swapped ? mate[i] : i);
      halves.second.push_back(swapped ? i : mate[i]);
    }
  }
  return halves;
}

/// The matching that one iteration found.
struct Trial {
  std::vector<std::uint32_t> mate;
  double cost = std::numeric_limits<double>::infinity();
};

class Matcher {
 public:
  Matcher(std::uint32_t count, const Row& row, const base::StopCheck& check_stop)
      : count_(count), row_(row), check_stop_(check_stop) {}

  /// Returns the matching of least total distance between the halves.
  Trial match(const Halves& halves) {
    const std::size_t rows = halves.first.size(), columns = halves.second.size();
    // Grows the matrix row by row: touching all of its memory takes seconds, and a stop would wait.
    costs_.reserve(rows * columns);
    base::StopTicks ticks(check_stop_);
    for (std::size_t r = 0; r < rows; ++r) {
      ticks(2 * columns);
      costs_.resize(std::max(costs_.size(), (r + 1) * columns));
      row_(halves.first[r], halves.second, costs_.data() + r * columns);
    }
    const auto assignment = assign(std::span<const double>(costs_), rows, columns, check_stop_);
    Trial trial{std::vector<std::uint32_t>(count_, kNone), 0.0};
    std::vector<double> distance(count_, 0.0);
    for (std::size_t r = 0; r < rows; ++r) {
      const std::uint32_t i = halves.first[r], j = halves.second[assignment.column[r]];
      trial.mate[i] = j;
      trial.mate[j] = i;
      distance[std::min(i, j)] = costs_[r * columns + assignment.column[r]];
    }
    // Adds in the order of the points, so that equal matchings have exactly equal costs.
    for (const double d : distance) trial.cost += d;
    return trial;
  }

 private:
  std::uint32_t count_;
  const Row& row_;
  const base::StopCheck& check_stop_;
  std::vector<double> costs_;
};

/// Keeps the best matching and decides when to stop.
class Search {
 public:
  Search(std::uint64_t total, const HalvingOptions& options) : total_(total), options_(options) {}

  void record(Trial&& trial) {
    ++result.iterations;
    if (!(trial.cost < best_)) return;
    best_ = trial.cost;
    result.mate = std::move(trial.mate);
    result.steps.push_back({result.iterations, best_});
  }
  [[nodiscard]] bool may_continue() const {
    if (result.iterations >= total_) return false;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    if (result.iterations > 0 && elapsed.count() > options_.seconds) return false;
    return result.iterations == 0 || !options_.progress ||
           options_.progress(result.iterations, total_, best_);
  }
  [[nodiscard]] std::uint64_t remaining() const { return total_ - result.iterations; }

  HalvingMatching result;

 private:
  std::uint64_t total_;
  const HalvingOptions& options_;
  double best_ = std::numeric_limits<double>::infinity();
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void monte_carlo(std::uint32_t count, const Row& row, const HalvingOptions& options,
                 unsigned threads, Search& search) {
  std::vector<Matcher> matchers(threads, Matcher(count, row, options.check_stop));
  std::vector<Trial> trials(threads);
  while (search.may_continue()) {
    // One round runs one iteration per thread. Its results are recorded in iteration order.
    const auto round = static_cast<unsigned>(std::min<std::uint64_t>(threads, search.remaining()));
    const std::uint64_t first = search.result.iterations;
    base::parallel_for(round, round, [&](std::size_t t) {
      std::mt19937_64 random(base::seed_of_run(options.seed, first + t));
      trials[t] = matchers[t].match(random_halves(count, random));
    });
    for (unsigned t = 0; t < round; ++t) search.record(std::move(trials[t]));
  }
}

void monotone(std::uint32_t count, const Row& row, const HalvingOptions& options, Search& search) {
  Matcher matcher(count, row, options.check_stop);
  while (search.may_continue()) {
    std::mt19937_64 random(base::seed_of_run(options.seed, search.result.iterations));
    search.record(matcher.match(search.result.mate.empty()
                                    ? random_halves(count, random)
                                    : separate_pairs(search.result.mate, random)));
  }
}

/// Throws std::invalid_argument if the matrices of all threads do not fit into the limit.
void check_memory(std::size_t count, unsigned threads, std::uint64_t limit) {
  const double half = 0.5 * static_cast<double>(count) + 1.0;
  const double needed = 8.0 * half * half * threads;
  if (count < kNone && (limit == 0 || needed <= static_cast<double>(limit))) return;
  throw std::invalid_argument(
      "the distances between two halves of " + std::to_string(count) + " points would need " +
      std::to_string(static_cast<std::uint64_t>(needed / (1024.0 * 1024.0))) +
      " MiB; match them exactly (point_matching.hpp), with fewer threads, or cluster them first");
}

HalvingMatching run(std::size_t count, const Row& row, const HalvingOptions& options) {
  unsigned threads = options.threads;
  if (threads == 0) threads = std::max(1u, std::thread::hardware_concurrency());
  if (options.method == Halving::monotone) threads = 1;
  check_memory(count, threads, options.memory_limit);
  const auto points = static_cast<std::uint32_t>(count);
  Search search(options.iterations > 0 ? options.iterations : std::max<std::uint64_t>(count, 1),
                options);
  if (count < 2) {
    search.result.mate.assign(count, kNone);
    if (count == 1) search.result.left_over = 0;
    return std::move(search.result);
  }
  if (options.method == Halving::monte_carlo) {
    monte_carlo(points, row, options, threads, search);
  } else {
    monotone(points, row, options, search);
  }
  HalvingMatching& result = search.result;
  result.cost = result.steps.back().cost;
  const auto unmatched = std::find(result.mate.begin(), result.mate.end(), kNone);
  if (unmatched != result.mate.end()) {
    result.left_over = static_cast<std::uint32_t>(unmatched - result.mate.begin());
  }
  return std::move(result);
}

}  // namespace

HalvingMatching match_by_halving(std::span<const Point3> points, const HalvingOptions& options) {
  // Squares of larger coordinates would overflow.
  constexpr double kMaxCoordinate = 1e150;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const double x : points[i]) {
      if (std::abs(x) <= kMaxCoordinate) continue;
      throw std::invalid_argument("point " + std::to_string(i) +
                                  " has a coordinate that is not finite or beyond 1e150: leave it "
                                  "out or scale the points");
    }
  }
  const Row row = [&](std::uint32_t from, std::span<const std::uint32_t> to, double* out) {
    const Point3& p = points[from];
    for (std::size_t k = 0; k < to.size(); ++k) {
      const Point3& q = points[to[k]];
      const double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
      out[k] = std::sqrt(x * x + y * y + z * z);
    }
  };
  return run(points.size(), row, options);
}

HalvingMatching match_by_halving(std::size_t count, const PairDistance& distance,
                                 const HalvingOptions& options) {
  const Row row = [&](std::uint32_t from, std::span<const std::uint32_t> to, double* out) {
    for (std::size_t k = 0; k < to.size(); ++k) {
      out[k] = distance(std::min(from, to[k]), std::max(from, to[k]));
      if (std::abs(out[k]) <= 1e300) continue;
      throw std::invalid_argument("the distance of " + std::to_string(std::min(from, to[k])) +
                                  " and " + std::to_string(std::max(from, to[k])) + " is " +
                                  std::to_string(out[k]) +
                                  ": distances must be finite and at most 1e300");
    }
  };
  return run(count, row, options);
}

}  // namespace terrace::matching
