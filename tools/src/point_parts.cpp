// SPDX-License-Identifier: GPL-3.0-or-later
#include "point_parts.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace terrace::tools {
namespace {

constexpr std::uint64_t kMostSample = std::uint64_t{1} << 20;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

PointParts::PointParts(const stream::Store& store, unsigned level, std::uint64_t points_per_part) {
  const std::span<const stream::LevelInfo> levels = store.levels();
  const std::uint64_t points = levels[level].points;
  if (points <= points_per_part) {
    divide({}, 1);
    return;
  }
  unsigned coarse = level;
  while (coarse < store.top() && levels[coarse].points > kMostSample) ++coarse;
  WindowPoints read;
  StoreWindow(store).points({{-kInfinity, -kInfinity}, {kInfinity, kInfinity}}, read, coarse);
  std::vector<Point2> sample;
  sample.reserve(read.positions.size());
  for (const stream::Point3& p : read.positions) sample.push_back({p[0], p[1]});
  read = {};
  const double weight = static_cast<double>(points) / static_cast<double>(sample.size());
  *this = PointParts(sample, weight, points_per_part);
}

PointParts::PointParts(std::span<Point2> sample, double weight, std::uint64_t points_per_part) {
  divide(sample, std::max<std::size_t>(
                     1, static_cast<std::size_t>(static_cast<double>(points_per_part) / weight)));
}

void PointParts::divide(std::span<Point2> sample, std::size_t most) {
  root_ = divide(sample, {{-kInfinity, -kInfinity}, {kInfinity, kInfinity}}, most);
}

std::uint32_t PointParts::divide(std::span<Point2> sample, const StoredBox& box, std::size_t most) {
  const auto leaf = [&] {
    boxes_.push_back(box);
    return kLeaf + static_cast<std::uint32_t>(boxes_.size() - 1);
  };
  if (sample.size() <= most) return leaf();
  StoredBox tight{sample[0], sample[0]};
  for (const Point2& p : sample) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      tight.min[axis] = std::min(tight.min[axis], p[axis]);
      tight.max[axis] = std::max(tight.max[axis], p[axis]);
    }
  }
  const std::size_t axis = tight.max[0] - tight.min[0] >= tight.max[1] - tight.min[1] ? 0 : 1;
  if (!(tight.min[axis] < tight.max[axis])) return leaf();
  const auto middle = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2);
  std::nth_element(sample.begin(), middle, sample.end(),
                   [&](const Point2& a, const Point2& b) { return a[axis] < b[axis]; });
  double split = (*middle)[axis];
  // Something has to lie on the lower side.
  if (split == tight.min[axis]) {
    split = kInfinity;
    for (const Point2& p : sample) {
      if (p[axis] > tight.min[axis]) split = std::min(split, p[axis]);
    }
  }
  const auto upper = std::partition(sample.begin(), sample.end(),
                                    [&](const Point2& p) { return p[axis] < split; });
  StoredBox low = box, high = box;
  low.max[axis] = high.min[axis] = split;
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({split, static_cast<std::uint32_t>(axis), {}});
  const std::uint32_t first = divide({sample.begin(), upper}, low, most);
  const std::uint32_t second = divide({upper, sample.end()}, high, most);
  nodes_[number].below = {first, second};
  return number;
}

std::uint32_t PointParts::part_of(const Point2& place) const {
  std::uint32_t at = root_;
  while (at < kLeaf) {
    const Node& node = nodes_[at];
    at = node.below[place[node.axis] < node.split ? 0 : 1];
  }
  return at - kLeaf;
}

}  // namespace terrace::tools
