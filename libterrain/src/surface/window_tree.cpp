// SPDX-License-Identifier: GPL-3.0-or-later
#include "surface/window_tree.hpp"

#include <algorithm>
#include <limits>

namespace terrace::terrain {
namespace {

constexpr std::uint32_t kTreeWindow = std::uint32_t{1} << 31;
constexpr std::uint64_t kMostCounted = std::uint64_t{1} << 18;
/// Halvings of the store's area. More come only where points lie on each other.
constexpr unsigned kDeepestTree = 48;

}  // namespace

WindowTree::WindowTree(const stream::Store& store, unsigned level, std::size_t points) {
  unsigned counted = level;
  while (counted < store.top() && store.levels()[counted].points > kMostCounted) ++counted;
  constexpr double kAll = std::numeric_limits<double>::infinity();
  std::vector<Point2> sample;
  {
    WindowPoints read;
    StoreWindow(store).points({{-kAll, -kAll}, {kAll, kAll}}, read, counted);
    sample.reserve(read.positions.size());
    for (const stream::Point3& p : read.positions) sample.push_back({p[0], p[1]});
  }
  const double each = static_cast<double>(store.levels()[level].points) /
                      static_cast<double>(std::max<std::size_t>(sample.size(), 1));
  const auto most = static_cast<std::size_t>(std::max(1.0, static_cast<double>(points) / each));
  const StoredBox all{{store.bounds().min[0], store.bounds().min[1]},
                      {store.bounds().max[0], store.bounds().max[1]}};
  root_ = split(all, sample, most, 0);
}

std::uint32_t WindowTree::split(const StoredBox& box, std::span<Point2> sample, std::size_t most,
                                unsigned depth) {
  const double width = box.max[0] - box.min[0], height = box.max[1] - box.min[1];
  Node node;
  node.axis = width >= height ? 0 : 1;
  const double low = box.min[node.axis], high = box.max[node.axis];
  node.middle = low + 0.5 * (high - low);
  if (sample.size() <= most || depth == kDeepestTree ||
      !(low < node.middle && node.middle < high)) {
    boxes_.push_back(box);
    return kTreeWindow | static_cast<std::uint32_t>(boxes_.size() - 1);
  }
  const auto cut = std::partition(sample.begin(), sample.end(),
                                  [&](const Point2& p) { return p[node.axis] < node.middle; });
  const auto before = static_cast<std::size_t>(cut - sample.begin());
  StoredBox half = box;
  half.max[node.axis] = node.middle;
  node.below = split(half, sample.first(before), most, depth + 1);
  half = box;
  half.min[node.axis] = node.middle;
  node.above = split(half, sample.subspan(before), most, depth + 1);
  nodes_.push_back(node);
  return static_cast<std::uint32_t>(nodes_.size() - 1);
}

std::size_t WindowTree::window_of(const Point2& place) const {
  std::uint32_t at = root_;
  while ((at & kTreeWindow) == 0) {
    const Node& node = nodes_[at];
    at = place[node.axis] < node.middle ? node.below : node.above;
  }
  return at & ~kTreeWindow;
}

}  // namespace terrace::terrain
