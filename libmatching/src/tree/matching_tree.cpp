// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/matching_tree.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <numeric>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>

#include "label_groups.hpp"
#include "terrace/matching/large_matching.hpp"

namespace terrace::matching {
namespace {

[[noreturn]] void refuse_tree(const std::string& what) {
  throw std::invalid_argument("make_matching_tree: " + what);
}

/// Thrown to end the work after `progress` returned false or another thread failed.
struct StopRequested {};

/// Returns the distance of two points. Scales them first if squares would overflow or underflow.
template <std::size_t D>
double distance(const std::array<double, D>& p, const std::array<double, D>& q) {
  double largest = 0.0;
  for (std::size_t d = 0; d < D; ++d) largest = std::max(largest, std::abs(p[d] - q[d]));
  int shift = 0;
  if (largest > 0x1p500 || (largest < 0x1p-500 && largest > 0.0)) std::frexp(largest, &shift);
  double sum = 0.0;
  for (std::size_t d = 0; d < D; ++d) {
    const double x = std::ldexp(p[d] - q[d], -shift);
    sum += x * x;
  }
  return std::ldexp(std::sqrt(sum), shift);
}

/// Returns the weighted mean of two points. The result never leaves the segment between them, so
/// pairs of equal points stay in place.
template <std::size_t D>
std::array<double, D> midpoint(const std::array<double, D>& p, double p_weight,
                               const std::array<double, D>& q, double q_weight) {
  const double sum = p_weight + q_weight;
  std::array<double, D> middle;
  for (std::size_t d = 0; d < D; ++d) {
    const double mean = p[d] * (p_weight / sum) + q[d] * (q_weight / sum);
    middle[d] = std::clamp(mean, std::min(p[d], q[d]), std::max(p[d], q[d]));
  }
  return middle;
}

template <std::size_t D>
class Builder {
 public:
  using Point = std::array<double, D>;

  Builder(std::span<const Point> points, const MatchingTreeOptions<Point>& options)
      : points_(points), options_(options) {
    check_sizes();
    check_values();
  }

  MatchingTree<Point> build() {
    const auto n = static_cast<std::uint32_t>(points_.size());
    if (n == 0) return {};
    tree_.root = 0;
    if (n == 1) return std::move(tree_);
    tree_.rows.resize(n - 1);
    tree_.positions.resize(n - 1);
    const LabelGroups groups = group_by_label(n, options_.labels);
    std::vector<Node> roots(groups.count());
    try {
      build_clusters(groups, roots);
      std::uint32_t level = 0;
      for (const Node& root : roots) level = std::max(level, root.level);
      const auto first = n - static_cast<std::uint32_t>(groups.count());
      tree_.root = merge(roots, first, level, threads(), true).number;
    } catch (const StopRequested&) {
      return {};
    }
    return std::move(tree_);
  }

 private:
  /// A node that has no parent yet.
  struct Node {
    std::uint32_t number, size, level;
    double weight;
    Point position;
  };

  void check_sizes() const {
    const std::size_t n = points_.size();
    const auto check_size = [&](std::size_t size, const char* what, const char* one) {
      if (size == 0 || size == n) return;
      refuse_tree(std::to_string(size) + " " + what + " for " + std::to_string(n) +
                  " points; give one " + one + " per point, or leave them out");
    };
    check_size(options_.labels.size(), "labels", "label");
    check_size(options_.weights.size(), "weights", "weight");
    // The tree, the clusters, and the data of each node of a level.
    const double needed = static_cast<double>(n) *
                          (sizeof(MatchingTreeRow) + 2.0 * sizeof(Point) + 4 * sizeof(double));
    const bool fits =
        options_.memory_limit == 0 || needed <= static_cast<double>(options_.memory_limit);
    if (n < kNone / 2 && fits) return;
    refuse_tree("the tree of " + std::to_string(n) + " points would need about " +
                std::to_string(static_cast<std::uint64_t>(needed / (1024.0 * 1024.0))) +
                " MiB, and at most 2^31 - 2 points are possible; build trees of parts");
  }

  void check_values() const {
    for (std::size_t k = 0; k < points_.size(); ++k) {
      for (const double c : points_[k]) {
        if (!std::isfinite(c)) {
          refuse_tree("a coordinate of point " + std::to_string(k) +
                      " is not finite; leave it out");
        }
      }
    }
    double sum = 0.0;
    for (std::size_t k = 0; k < options_.weights.size(); ++k) {
      const double w = options_.weights[k];
      if (!(w > 0.0) || !std::isfinite(w)) {
        refuse_tree("the weight of point " + std::to_string(k) + " is " + std::to_string(w) +
                    "; weights must be positive and finite");
      }
      sum += w;
    }
    if (!std::isfinite(sum)) refuse_tree("the weights' sum overflows a double; divide them");
  }

  [[nodiscard]] unsigned threads() const {
    if (options_.threads != 0) return options_.threads;
    return std::max(1u, std::thread::hardware_concurrency());
  }

  // A cluster of m points makes m - 1 rows, so the position of every row is known in advance.
  void build_clusters(const LabelGroups& groups, std::vector<Node>& roots) {
    std::vector<std::uint32_t> by_size(groups.count());
    std::iota(by_size.begin(), by_size.end(), 0u);
    std::stable_sort(by_size.begin(), by_size.end(), [&](std::uint32_t g, std::uint32_t h) {
      return groups.group(g).size() > groups.group(h).size();
    });
    const unsigned clusters =
        static_cast<unsigned>(std::min<std::size_t>(threads(), groups.count()));
    const unsigned threads_per_cluster = threads() / clusters;
    std::atomic<std::size_t> next{0};
    std::vector<std::exception_ptr> failures(clusters);
    const auto work = [&](unsigned t) {
      try {
        for (std::size_t k = next++; k < by_size.size() && !stopped_; k = next++) {
          const std::uint32_t g = by_size[k];
          std::vector<Node> nodes = make_leaves(groups.group(g));
          roots[g] = merge(nodes, groups.begin[g] - g, 0, threads_per_cluster, t == 0);
        }
      } catch (const StopRequested&) {
        // The caller or a failure of another thread ended the work.
      } catch (...) {
        stopped_ = true;
        failures[t] = std::current_exception();
      }
    };
    {
      std::vector<std::jthread> others;
      try {
        for (unsigned t = 1; t < clusters; ++t) others.emplace_back(work, t);
      } catch (const std::system_error&) {
        // No more threads are available. The existing ones do all the work.
      }
      work(0);
    }
    for (const std::exception_ptr& failure : failures) {
      if (failure) std::rethrow_exception(failure);
    }
    if (stopped_) throw StopRequested();
  }

  std::vector<Node> make_leaves(std::span<const std::uint32_t> group) const {
    std::vector<Node> nodes;
    nodes.reserve(group.size());
    for (const std::uint32_t i : group) {
      const double weight = options_.weights.empty() ? 1.0 : options_.weights[i];
      nodes.push_back({i, 1, 0, weight, points_[i]});
    }
    return nodes;
  }

  /// Matches repeatedly until one node is left and returns it. Writes rows from `row` on.
  Node merge(std::vector<Node>& nodes, std::uint32_t row, std::uint32_t level, unsigned threads,
             bool callers_thread) {
    while (nodes.size() > 1) {
      ++level;
      const std::vector<std::uint32_t> mate = match(nodes, threads);
      std::size_t remaining = 0;
      const std::uint32_t first = row;
      if (options_.check_stop) options_.check_stop();
      for (std::uint32_t i = 0; i < nodes.size(); ++i) {
        if (mate[i] == kNone) {
          nodes[remaining++] = nodes[i];
        } else if (i < mate[i]) {
          nodes[remaining++] = make_parent(nodes[i], nodes[mate[i]], row++, level);
        }
      }
      nodes.resize(remaining);
      report(row - first, callers_thread);
    }
    return nodes.front();
  }

  std::vector<std::uint32_t> match(const std::vector<Node>& nodes, unsigned threads) const {
    std::vector<Point> positions(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) positions[i] = nodes[i].position;
    if (!options_.matcher) {
      LargeMatchingOptions options;
      options.threads = threads;
      options.check_stop = options_.check_stop;
      return std::move(match_large(std::span<const Point>(positions), options).mate);
    }
    std::vector<std::uint32_t> mate = options_.matcher(positions);
    if (mate.size() != nodes.size()) {
      refuse_tree("the matcher returned " + std::to_string(mate.size()) + " partners for " +
                  std::to_string(nodes.size()) + " nodes");
    }
    std::size_t unmatched = 0;
    for (std::uint32_t i = 0; i < mate.size(); ++i) {
      if (mate[i] == kNone && ++unmatched <= mate.size() % 2) continue;
      if (mate[i] < mate.size() && mate[i] != i && mate[mate[i]] == i) continue;
      refuse_tree("the matcher did not pair node " + std::to_string(i) + " of " +
                  std::to_string(mate.size()) + " mutually");
    }
    return mate;
  }

  Node make_parent(const Node& p, const Node& q, std::uint32_t row, std::uint32_t level) {
    const double length = distance(p.position, q.position);
    if (!std::isfinite(length)) {
      refuse_tree("nodes " + std::to_string(p.number) + " and " + std::to_string(q.number) +
                  " are farther apart than a double can represent; scale the points");
    }
    const Node parent{static_cast<std::uint32_t>(points_.size()) + row, p.size + q.size, level,
                      p.weight + q.weight, midpoint(p.position, p.weight, q.position, q.weight)};
    tree_.rows[row] = {std::min(p.number, q.number), std::max(p.number, q.number), length,
                       parent.size, level};
    tree_.positions[row] = parent.position;
    return parent;
  }

  void report(std::size_t rows, bool callers_thread) {
    const std::size_t done = done_ += rows;
    if (callers_thread && options_.progress && !options_.progress(done, tree_.rows.size())) {
      stopped_ = true;
    }
    if (stopped_) throw StopRequested();
  }

  std::span<const Point> points_;
  const MatchingTreeOptions<Point>& options_;
  MatchingTree<Point> tree_;
  std::atomic<std::size_t> done_{0};
  std::atomic<bool> stopped_{false};
};

}  // namespace

MatchingTree<Point2> make_matching_tree(std::span<const Point2> points,
                                        const MatchingTreeOptions<Point2>& options) {
  return Builder<2>(points, options).build();
}

MatchingTree<Point3> make_matching_tree(std::span<const Point3> points,
                                        const MatchingTreeOptions<Point3>& options) {
  return Builder<3>(points, options).build();
}

}  // namespace terrace::matching
