// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

#include <terrace/base/box.hpp>

#include "assignment/sparse_solver.hpp"
#include "terrace/matching/assignment.hpp"

namespace terrace::matching {

template <std::size_t D>
double distance_between(const std::array<double, D>& a, const std::array<double, D>& b) {
  double sum = 0;
  for (std::size_t d = 0; d < D; ++d) sum += (a[d] - b[d]) * (a[d] - b[d]);
  return std::sqrt(sum);
}

/// A kd-tree of the columns that finds those with the least distance minus label.
///
/// Columns are numbered by their position in the tree. original() returns the caller's number. Each
/// node holds the largest label below it.
template <std::size_t D>
class ColumnTree {
 public:
  using Point = std::array<double, D>;

  explicit ColumnTree(std::span<const Point> points) : original_(points.size()) {
    std::iota(original_.begin(), original_.end(), 0u);
    if (!points.empty()) build(points, 0, 0, points.size());
    for (const std::uint32_t j : original_) points_.push_back(points[j]);
    taken_.assign(points.size(), 0);
    mark_.assign(points.size(), 0);
  }

  std::uint32_t original(std::uint32_t column) const { return original_[column]; }
  const Point& point(std::uint32_t column) const { return points_[column]; }

  /// Hides a column from the next call of nearest().
  void exclude(std::uint32_t column) { mark_[column] = round_ + 1; }

  /// Appends to `found`, in no particular order, the `count` columns with the least distance -
  /// label among those that are not hidden and below `limit`, or all of them if there are fewer.
  /// Returns a lower bound of distance - label for all other columns: the largest value found, or
  /// `limit`.
  double nearest(const Point& p, const std::vector<double>& labels, std::size_t count, double limit,
                 std::vector<Candidate>& found) {
    ++round_;
    best_.clear();
    if (!nodes_.empty()) descend_nearest(p, labels, count, limit, 0);
    for (const Best& b : best_) found.push_back({b.column, b.distance});
    return best_.size() < count ? limit : best_.front().key;
  }

  /// Returns the nearest column that is not taken, or kUnassigned if all are.
  Candidate nearest_free(const Point& p) const {
    Candidate best{kUnassigned, std::numeric_limits<double>::infinity()};
    if (!nodes_.empty()) descend_free(p, 0, best);
    return best;
  }

  /// Excludes a column from nearest_free().
  void mark_taken(std::uint32_t column) {
    taken_[column] = 1;
    for (std::uint32_t n = leaf_[column];; n = nodes_[n].parent) {
      --nodes_[n].free;
      if (n == 0) break;
    }
  }

  /// Lowers the label bounds of the nodes above a column whose label fell, up to the first node
  /// that does not change.
  void update_label(const std::vector<double>& labels, std::uint32_t column) {
    std::uint32_t n = leaf_[column];
    const auto first = labels.begin() + nodes_[n].begin, last = labels.begin() + nodes_[n].end;
    for (double label = *std::max_element(first, last); label < nodes_[n].label;) {
      nodes_[n].label = label;
      if (n == 0) break;
      n = nodes_[n].parent;
      label = std::max(nodes_[n + 1].label, nodes_[nodes_[n].right].label);
    }
  }

 private:
  static constexpr std::size_t kLeaf = 8;

  /// A node. Its left child is the next one in the array.
  struct Node {
    base::Box<D> box;
    double label = 0.0;
    std::uint32_t begin, end, free, right = 0, parent = 0;
  };
  struct Best {
    double key, distance;
    std::uint32_t column;
    bool operator<(const Best& other) const {
      return key != other.key ? key < other.key : column < other.column;
    }
  };

  void build(std::span<const Point> points, std::uint32_t parent, std::size_t begin,
             std::size_t end) {
    const auto index = static_cast<std::uint32_t>(nodes_.size());
    Node node;
    for (std::size_t k = begin; k < end; ++k) node.box.include(points[original_[k]]);
    node.begin = static_cast<std::uint32_t>(begin);
    node.end = static_cast<std::uint32_t>(end);
    node.free = node.end - node.begin;
    node.parent = parent;
    nodes_.push_back(node);
    if (end - begin <= kLeaf) {
      leaf_.resize(end, index);
      return;
    }
    const base::Box<D>& box = node.box;
    std::size_t widest = 0;
    for (std::size_t d = 1; d < D; ++d) {
      if (box.max[d] - box.min[d] > box.max[widest] - box.min[widest]) widest = d;
    }
    const std::size_t middle = begin + (end - begin) / 2;
    const auto at = [&](std::size_t k) {
      return original_.begin() + static_cast<std::ptrdiff_t>(k);
    };
    // Ties follow the caller's order, so every standard library builds the same tree.
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
      const double x = points[a][widest], y = points[b][widest];
      return x != y ? x < y : a < b;
    });
    build(points, index, begin, middle);
    nodes_[index].right = static_cast<std::uint32_t>(nodes_.size());
    build(points, index, middle, end);
  }

  void descend_nearest(const Point& p, const std::vector<double>& labels, std::size_t count,
                       double limit, std::uint32_t n) {
    const Node& node = nodes_[n];
    const auto cutoff = [&] { return best_.size() < count ? limit : best_.front().key; };
    if (node.right == 0) {
      for (std::uint32_t j = node.begin; j < node.end; ++j) {
        if (mark_[j] == round_) continue;
        const double distance = distance_between(p, points_[j]);
        const double key = distance - labels[j];
        if (!(key < cutoff())) continue;
        const bool full = best_.size() == count;
        if (full) {
          std::pop_heap(best_.begin(), best_.end());
          best_.pop_back();
        }
        best_.push_back({key, distance, j});
        // Becomes a heap only when it is full.
        if (full) {
          std::push_heap(best_.begin(), best_.end());
        } else if (best_.size() == count) {
          std::make_heap(best_.begin(), best_.end());
        }
      }
      return;
    }
    std::uint32_t near = n + 1, far = node.right;
    double to_near = std::sqrt(nodes_[near].box.squared_distance(p)) - nodes_[near].label;
    double to_far = std::sqrt(nodes_[far].box.squared_distance(p)) - nodes_[far].label;
    if (to_far < to_near) {
      std::swap(near, far);
      std::swap(to_near, to_far);
    }
    if (to_near < cutoff()) descend_nearest(p, labels, count, limit, near);
    if (to_far < cutoff()) descend_nearest(p, labels, count, limit, far);
  }

  void descend_free(const Point& p, std::uint32_t n, Candidate& best) const {
    const Node& node = nodes_[n];
    if (node.free == 0) return;
    if (node.right == 0) {
      for (std::uint32_t j = node.begin; j < node.end; ++j) {
        if (taken_[j] != 0) continue;
        const double distance = distance_between(p, points_[j]);
        if (distance < best.cost) best = {j, distance};
      }
      return;
    }
    std::uint32_t near = n + 1, far = node.right;
    double to_near = std::sqrt(nodes_[near].box.squared_distance(p));
    double to_far = std::sqrt(nodes_[far].box.squared_distance(p));
    if (to_far < to_near) {
      std::swap(near, far);
      std::swap(to_near, to_far);
    }
    if (to_near < best.cost) descend_free(p, near, best);
    if (to_far < best.cost) descend_free(p, far, best);
  }

  std::vector<std::uint32_t> original_, leaf_;
  std::vector<Point> points_;
  std::vector<Node> nodes_;
  std::vector<std::uint8_t> taken_;
  std::vector<std::uint64_t> mark_;
  std::uint64_t round_ = 0;
  std::vector<Best> best_;
};

}  // namespace terrace::matching
