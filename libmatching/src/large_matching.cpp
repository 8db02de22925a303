// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/large_matching.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <terrace/base/parallel.hpp>
#include <terrace/base/stop_check.hpp>

#include "label_groups.hpp"
#include "windows/discs.hpp"

namespace terrace::matching::windows {
namespace {

/// A point, or a pair of points represented by its midpoint. Windows never divide a pair.
template <std::size_t D>
struct Unit {
  std::array<double, D> centre;
  std::uint32_t index;  ///< index of the point, or of the first of the pair
};

/// Reorders units so that consecutive ranges are compact windows of at most `max_size` units.
/// Appends the end of each range, counted from `first`, to `ends`.
///
/// Each range is split across the longest side of its bounding box, at a fraction between 3/8 and
/// 5/8 that depends on the seed. Different seeds thus give windows with different borders. With
/// `even`, every part except the last has an even number of units.
/// Cost: O(n log(n / max_size)).
template <std::size_t D>
void cut(std::span<Unit<D>> units, std::size_t max_size, bool even, std::uint64_t seed,
         std::size_t first, std::vector<std::size_t>& ends, const base::StopCheck& check_stop) {
  base::StopTicks ticks(check_stop);
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, units.size()}};
  while (!open.empty()) {
    const auto [begin, end] = open.back();
    open.pop_back();
    ticks(8 * (end - begin));
    if (end - begin <= max_size) {
      if (end != begin) ends.push_back(first + end);
      continue;
    }
    std::size_t axis = 0;
    double widest = -1.0;
    for (std::size_t d = 0; d < D; ++d) {
      double lo = units[begin].centre[d], hi = lo;
      for (std::size_t k = begin; k < end; ++k) {
        lo = std::min(lo, units[k].centre[d]);
        hi = std::max(hi, units[k].centre[d]);
      }
      if (hi - lo > widest) {
        widest = hi - lo;
        axis = d;
      }
    }
    std::uint64_t z = seed * 0x9e3779b97f4a7c15u + begin * 0xbf58476d1ce4e5b9u + end;
    z = (z ^ (z >> 31)) * 0x94d049bb133111ebu;
    const double share = 0.375 + 0.25 * static_cast<double>(z >> 11) * 0x1p-53;
    auto part = static_cast<std::size_t>(share * static_cast<double>(end - begin));
    part = std::clamp<std::size_t>(even ? part & ~std::size_t{1} : part, 1 + (even ? 1u : 0u),
                                   end - begin - 1);
    std::nth_element(units.begin() + static_cast<std::ptrdiff_t>(begin),
                     units.begin() + static_cast<std::ptrdiff_t>(begin + part),
                     units.begin() + static_cast<std::ptrdiff_t>(end),
                     [axis](const Unit<D>& a, const Unit<D>& b) {
                       return std::tie(a.centre[axis], a.index) < std::tie(b.centre[axis], b.index);
                     });
    // The left part is processed first, so it is pushed last.
    open.emplace_back(begin + part, end);
    open.emplace_back(begin, begin + part);
  }
}

}  // namespace
}  // namespace terrace::matching::windows

namespace terrace::matching {
namespace {

using windows::Discs;
using windows::Unit;

[[noreturn]] void refuse_large(const std::string& what) {
  throw std::invalid_argument("match_large: " + what);
}

/// Sets of points that are matched independently. Set k is [ends[k - 1], ends[k]) of `points`.
struct Parts {
  std::vector<std::uint32_t> points;
  std::vector<std::size_t> ends;

  [[nodiscard]] std::size_t count() const { return ends.size(); }
  [[nodiscard]] std::span<const std::uint32_t> part(std::size_t k) const {
    const std::size_t begin = k == 0 ? 0 : ends[k - 1];
    return std::span(points).subspan(begin, ends[k] - begin);
  }
};

template <std::size_t D>
class Windows {
 public:
  using Point = std::array<double, D>;

  /// points: scaled so that squares neither overflow nor underflow. All arguments must outlive the
  /// object.
  Windows(std::span<const Point> points, const LargeMatchingOptions& options,
          const PointMetric& metric)
      : points_(points),
        options_(options),
        metric_(metric),
        threads_(options.threads == 0 ? std::max(1u, std::thread::hardware_concurrency())
                                      : options.threads) {
    result_.mate.assign(points.size(), kNone);
  }

  LargeMatching solve() {
    match_initial_parts();
    cost_ = cost();
    for (unsigned round = 1; round <= options_.rounds && !stopped_; ++round) {
      const double previous_cost = cost_;
      const Parts parts = parts_of_pairs(round);
      const bool complete = match_parts(parts);
      cost_ = cost();
      if (!complete) break;
      ++result_.rounds;
      result_.optimal = parts.count() == 1;
      if (result_.optimal) break;
      if (previous_cost - cost_ <= options_.tolerance * previous_cost) break;
    }
    result_.cost = cost_;
    // The bound can exceed the cost by rounding alone.
    result_.dual_bound =
        result_.optimal
            ? cost_
            : std::min(cost_, discs_.bound(points_, metric_, threads_, options_.check_stop));
    const auto unmatched = std::find(result_.mate.begin(), result_.mate.end(), kNone);
    if (unmatched != result_.mate.end()) {
      result_.left_over = static_cast<std::uint32_t>(unmatched - result_.mate.begin());
    }
    return std::move(result_);
  }

 private:
  double distance(std::uint32_t i, std::uint32_t j) const {
    if (metric_.distance) return metric_.distance(i, j);
    double sum = 0.0;
    for (std::size_t d = 0; d < D; ++d) {
      sum += (points_[i][d] - points_[j][d]) * (points_[i][d] - points_[j][d]);
    }
    return std::sqrt(sum);
  }

  double cost() const {
    double sum = 0.0;
    for (std::uint32_t i = 0; i < result_.mate.size(); ++i) {
      const std::uint32_t j = result_.mate[i];
      if (j != kNone && i < j) sum += distance(i, j);
    }
    return sum;
  }

  // Matches each part, then the points left over in odd parts, until at most one remains.
  void match_initial_parts() {
    std::vector<std::uint32_t> all(points_.size());
    std::iota(all.begin(), all.end(), 0u);
    Parts parts = options_.labels.empty() ? compact_parts(all) : clusters();
    while (true) {
      match_parts(parts, true);
      std::vector<std::uint32_t> unmatched;
      for (std::uint32_t i = 0; i < result_.mate.size(); ++i) {
        if (result_.mate[i] == kNone) unmatched.push_back(i);
      }
      if (unmatched.size() < 2) break;
      needs_duals_ = false;
      parts = compact_parts(unmatched);
    }
    needs_duals_ = true;
  }

  Parts compact_parts(std::span<const std::uint32_t> subset) const {
    std::vector<Unit<D>> units;
    units.reserve(subset.size());
    for (const std::uint32_t i : subset) units.push_back({points_[i], i});
    Parts parts;
    windows::cut<D>(units, options_.window, true, 0, 0, parts.ends, options_.check_stop);
    parts.points.reserve(units.size());
    for (const auto& unit : units) parts.points.push_back(unit.index);
    sort_within(parts);
    return parts;
  }

  // Cuts clusters with more points than four windows, which would take too much time or memory.
  Parts clusters() const {
    const LabelGroups groups =
        group_by_label(static_cast<std::uint32_t>(points_.size()), options_.labels);
    Parts parts;
    std::vector<Unit<D>> units;
    for (std::size_t g = 0; g < groups.count(); ++g) {
      units.clear();
      for (const std::uint32_t i : groups.group(g)) units.push_back({points_[i], i});
      windows::cut<D>(units, 4 * options_.window, true, 0, groups.begin[g], parts.ends,
                      options_.check_stop);
      for (const auto& unit : units) parts.points.push_back(unit.index);
    }
    sort_within(parts);
    return parts;
  }

  // Returns compact sets of the current pairs. One of them contains the point left over.
  Parts parts_of_pairs(unsigned round) const {
    std::vector<Unit<D>> units;
    units.reserve(points_.size() / 2 + 1);
    for (std::uint32_t i = 0; i < result_.mate.size(); ++i) {
      const std::uint32_t j = result_.mate[i];
      if (j < i) continue;
      Unit<D> unit{points_[i], i};
      for (std::size_t d = 0; d < D && j != kNone; ++d) {
        unit.centre[d] = 0.5 * (points_[i][d] + points_[j][d]);
      }
      units.push_back(unit);
    }
    Parts parts;
    windows::cut<D>(units, options_.window / 2, false, round, 0, parts.ends, options_.check_stop);
    parts.points.reserve(points_.size());
    std::size_t done = 0;
    for (std::size_t& end : parts.ends) {
      for (; done < end; ++done) {
        parts.points.push_back(units[done].index);
        const std::uint32_t mate = result_.mate[units[done].index];
        if (mate != kNone) parts.points.push_back(mate);
      }
      end = parts.points.size();
    }
    sort_within(parts);
    return parts;
  }

  // Sorts each part, because cut() leaves it in the order of the standard library's nth_element.
  static void sort_within(Parts& parts) {
    std::size_t begin = 0;
    for (const std::size_t end : parts.ends) {
      std::sort(parts.points.begin() + static_cast<std::ptrdiff_t>(begin),
                parts.points.begin() + static_cast<std::ptrdiff_t>(end));
      begin = end;
    }
  }

  bool report() {
    if (!options_.progress) return true;
    const std::uint64_t done = windows_done_.load();
    const std::uint64_t remaining = planned_ > done ? planned_ - done : 0;
    const std::uint64_t rounds = options_.rounds - std::min(options_.rounds, result_.rounds + 1);
    if (!options_.progress(done, done + remaining + rounds * parts_, cost_)) stopped_ = true;
    // The first matching must be complete.
    return !stopped_ || cost_ == 0.0;
  }

  /// Returns false if stopped before all parts were matched. The parts matched so far are kept.
  bool match_parts(const Parts& parts, bool initial = false) {
    // A stopped round lacks the duals of some points, so the duals of the previous round are kept.
    Discs discs(needs_duals_ ? points_.size() : 0);
    if (needs_duals_) discs.start(parts.count());
    parts_ = parts.count();
    planned_ = windows_done_.load() + parts_;
    // Progress is reported after each part that the calling thread matches. After a stop no more
    // parts begin.
    std::atomic<bool> stopped = false;
    base::parallel_for(parts.count(), threads_, [&](std::size_t k, unsigned thread) {
      if (stopped) return;
      match_part(k, parts.part(k), initial, discs);
      ++windows_done_;
      if (thread == 0 && !report()) stopped = true;
    });
    const bool all = !stopped;
    result_.windows = windows_done_.load();
    if (all && needs_duals_) discs_ = std::move(discs);
    return all;
  }

  void match_part(std::size_t k, std::span<const std::uint32_t> members, bool initial,
                  Discs& discs) {
    std::vector<Point> points(members.size());
    for (std::size_t m = 0; m < members.size(); ++m) points[m] = points_[members[m]];
    PointMatchingOptions options;
    options.check_stop = options_.check_stop;
    if (metric_.distance) {
      options.metric = metric_;
      options.metric.distance = [&](std::uint32_t i, std::uint32_t j) {
        return metric_.distance(members[i], members[j]);
      };
    }
    const PointMatching matching = match_points(std::span<const Point>(points), options);
    if (needs_duals_) discs.store(k, members, matching);
    // Rejects a new matching of equal cost. Otherwise two of them might alternate forever.
    if (!initial && !(matching.cost < cost_of(members) * (1.0 - 1e-12))) return;
    for (std::size_t m = 0; m < members.size(); ++m) {
      const std::uint32_t mate = matching.mate[m];
      result_.mate[members[m]] = mate == kNone ? kNone : members[mate];
    }
  }

  double cost_of(std::span<const std::uint32_t> members) const {
    double sum = 0.0;
    for (const std::uint32_t i : members) {
      const std::uint32_t j = result_.mate[i];
      if (j != kNone && i < j) sum += distance(i, j);
    }
    return sum;
  }

  std::span<const Point> points_;
  const LargeMatchingOptions& options_;
  const PointMetric& metric_;
  unsigned threads_;
  LargeMatching result_;
  Discs discs_{0};  // of the last completed round
  bool needs_duals_ = true, stopped_ = false;
  double cost_ = 0.0;
  std::atomic<std::uint64_t> windows_done_{0};
  std::uint64_t planned_ = 0, parts_ = 0;
};

template <std::size_t D>
LargeMatching match(std::span<const std::array<double, D>> points,
                    const LargeMatchingOptions& options) {
  if (!options.labels.empty() && options.labels.size() != points.size()) {
    refuse_large(std::to_string(options.labels.size()) + " labels for " +
                 std::to_string(points.size()) + " points; give one for each");
  }
  if (options.window < 4)
    refuse_large("window is " + std::to_string(options.window) + "; it must be at least 4");
  if (!(options.tolerance >= 0.0)) refuse_large("tolerance must be a number and not negative");
  LargeMatching result;
  if (options.labels.empty() && points.size() <= std::max<std::size_t>(options.exact_limit, 3)) {
    PointMatchingOptions exact;
    exact.metric = options.metric;
    exact.check_stop = options.check_stop;
    PointMatching matching = match_points(points, exact);
    result.mate = std::move(matching.mate);
    result.cost = matching.cost;
    result.dual_bound = std::min(matching.dual_bound, matching.cost);
    result.left_over = matching.left_over;
    result.optimal = true;
    return result;
  }
  if (points.size() >= kNone) refuse_large("at most 2^32 - 2 points are possible");
  double largest = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const double c : points[i]) {
      if (!std::isfinite(c)) {
        refuse_large("a coordinate of point " + std::to_string(i) + " is not finite; leave it out");
      }
      largest = std::max(largest, std::abs(c));
    }
  }
  int shift = 0;
  if (largest > 0x1p400 || (largest < 0x1p-400 && largest > 0.0)) std::frexp(largest, &shift);
  if (shift == 0) return Windows<D>(points, options, options.metric).solve();
  std::vector<std::array<double, D>> scaled(points.begin(), points.end());
  for (auto& p : scaled) {
    for (double& c : p) c = std::ldexp(c, -shift);
  }
  PointMetric metric = options.metric;
  metric.factor = std::ldexp(metric.factor, shift);
  result = Windows<D>(std::span<const std::array<double, D>>(scaled), options, metric).solve();
  if (!metric.distance) {
    result.cost = std::ldexp(result.cost, shift);
    result.dual_bound = std::ldexp(result.dual_bound, shift);
  }
  if (!std::isfinite(result.cost)) refuse_large("the cost overflows a double; scale the points");
  return result;
}

}  // namespace

double LargeMatching::gap() const {
  if (optimal || cost <= dual_bound) return 0.0;
  return dual_bound > 0.0 ? cost / dual_bound - 1.0 : std::numeric_limits<double>::infinity();
}

LargeMatching match_large(std::span<const Point2> points, const LargeMatchingOptions& options) {
  return match<2>(points, options);
}

LargeMatching match_large(std::span<const Point3> points, const LargeMatchingOptions& options) {
  return match<3>(points, options);
}

}  // namespace terrace::matching
