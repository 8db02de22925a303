// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <terrace/base/box.hpp>
#include <terrace/base/stop_check.hpp>

namespace terrace::matching::blossom {

/// The order of points by recursive halving along the longer side of their bounding box, down to
/// kLeaf points. It depends on coordinates and indices only, not on the standard library's
/// nth_element.
inline constexpr std::uint32_t kLeaf = 8;

template <std::size_t D>
std::vector<std::uint32_t> halving_order(std::span<const std::array<double, D>> points,
                                         base::StopTicks ticks = {}) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, points.size()}};
  while (!open.empty()) {
    const auto [begin, end] = open.back();
    open.pop_back();
    ticks(8 * (end - begin));
    if (end - begin <= kLeaf) {
      std::sort(order.begin() + static_cast<std::ptrdiff_t>(begin),
                order.begin() + static_cast<std::ptrdiff_t>(end));
      continue;
    }
    std::size_t axis = 0;
    double widest = -1.0;
    for (std::size_t d = 0; d < D; ++d) {
      double lo = points[order[begin]][d], hi = lo;
      for (std::size_t k = begin; k < end; ++k) {
        lo = std::min(lo, points[order[k]][d]);
        hi = std::max(hi, points[order[k]][d]);
      }
      if (hi - lo > widest) {
        widest = hi - lo;
        axis = d;
      }
    }
    const std::size_t middle = begin + (end - begin + 1) / 2;
    std::nth_element(order.begin() + static_cast<std::ptrdiff_t>(begin),
                     order.begin() + static_cast<std::ptrdiff_t>(middle),
                     order.begin() + static_cast<std::ptrdiff_t>(end),
                     [&](std::uint32_t a, std::uint32_t b) {
                       return std::tie(points[a][axis], a) < std::tie(points[b][axis], b);
                     });
    open.emplace_back(begin, middle);
    open.emplace_back(middle, end);
  }
  return order;
}

/// A k-d tree with boxes over a sequence of points in halving order, or a part of such a sequence.
template <std::size_t D>
class KdTree {
 public:
  using Point = std::array<double, D>;

  struct Node {
    base::Box<D> box;
    std::uint32_t begin, end;
    std::uint32_t right;  // 0: a leaf. The left child is the next node
  };

  explicit KdTree(std::vector<Point> points) : points_(std::move(points)) {
    nodes_.reserve(points_.size() / 2 + 1);
    if (!points_.empty()) build(0, static_cast<std::uint32_t>(points_.size()));
  }

  std::span<const Point> points() const { return points_; }
  const std::vector<Node>& nodes() const { return nodes_; }

  static double distance2(const Point& a, const Point& b) {
    double sum = 0.0;
    for (std::size_t d = 0; d < D; ++d) sum += (a[d] - b[d]) * (a[d] - b[d]);
    return sum;
  }

  /// Stores the k points nearest to point i (excluding i) in `neighbours`, nearest first. Stores
  /// fewer if there are fewer. Ties are in the order in which the tree is walked.
  void nearest(std::uint32_t i, std::size_t k,
               std::vector<std::pair<double, std::uint32_t>>& neighbours) const {
    neighbours.clear();
    const Point& p = points_[i];
    std::array<std::pair<double, std::uint32_t>, 64> open;
    std::size_t depth = 0;
    open[depth++] = {0.0, 0};
    while (depth != 0) {
      const auto [far, at] = open[--depth];
      if (neighbours.size() == k && far >= neighbours.back().first) continue;
      const Node& node = nodes_[at];
      if (node.right != 0) {
        const double left = nodes_[at + 1].box.squared_distance(p);
        const double right = nodes_[node.right].box.squared_distance(p);
        const bool left_first = left <= right;
        open[depth++] = left_first ? std::pair{right, node.right} : std::pair{left, at + 1};
        open[depth++] = left_first ? std::pair{left, at + 1} : std::pair{right, node.right};
        continue;
      }
      for (std::uint32_t j = node.begin; j < node.end; ++j) {
        const double d = distance2(points_[j], p);
        if (j == i || (neighbours.size() == k && d >= neighbours.back().first)) continue;
        if (neighbours.size() == k) neighbours.pop_back();
        auto place = neighbours.end();
        while (place != neighbours.begin() && (place - 1)->first > d) --place;
        neighbours.insert(place, {d, j});
      }
    }
  }

 private:
  std::uint32_t build(std::uint32_t begin, std::uint32_t end) {
    const auto at = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back({{}, begin, end, 0});
    if (end - begin <= kLeaf) {
      for (std::uint32_t k = begin; k < end; ++k) nodes_[at].box.include(points_[k]);
      return at;
    }
    const std::uint32_t middle = begin + (end - begin + 1) / 2;
    const std::uint32_t left = build(begin, middle), right = build(middle, end);
    nodes_[at].right = right;
    nodes_[at].box = nodes_[left].box;
    nodes_[at].box.include(nodes_[right].box);
    return at;
  }

  std::vector<Point> points_;
  std::vector<Node> nodes_;
};

}  // namespace terrace::matching::blossom
