// SPDX-License-Identifier: Apache-2.0
#include "surface/window_tree.hpp"

#include <algorithm>
#include <limits>

namespace terrace::terrain {
namespace {

constexpr std::uint64_t kMaxCounted = std::uint64_t{1} << 18;
/// A view's share of a level is unknown, so it reads finer levels until it has this many points.
constexpr std::size_t kFewestCounted = std::size_t{1} << 14;
/// Limit on halvings of the store's area; only coincident points need more.
constexpr unsigned kDeepestTree = 48;

}  // namespace

WindowTree::WindowTree(const stream::Store& store, unsigned level, std::size_t points) {
  unsigned counted = level;
  while (counted < store.top() && store.levels()[counted].points > kMaxCounted) ++counted;
  constexpr double kAll = std::numeric_limits<double>::infinity();
  std::vector<Point2> sample;
  {
    WindowPoints read;
    StoreWindow window(store);
    const auto read_counted = [&] {
      window.points({{-kAll, -kAll}, {kAll, kAll}}, read, counted);
      return read.positions.size();
    };
    while (read_counted() < kFewestCounted && store.condition() != nullptr && counted > level) {
      --counted;
    }
    sample.reserve(read.positions.size());
    for (const stream::Point3& p : read.positions) sample.push_back({p[0], p[1]});
  }
  const double each =
      static_cast<double>(store.levels()[level].points) /
      static_cast<double>(std::max<std::uint64_t>(store.levels()[counted].points, 1));
  // A level without points has nothing to divide.
  const double sampled = each > 0 ? static_cast<double>(points) / each : 0.0;
  const auto max_sample = static_cast<std::size_t>(
      std::clamp(sampled, 1.0, static_cast<double>(std::max<std::size_t>(sample.size(), 1))));
  split(flat(store.bounds()), sample, each, max_sample, 0);
}

std::uint32_t WindowTree::split(const StoredBox& box, std::span<Point2> sample, double each,
                                std::size_t max_sample, unsigned depth) {
  const auto number = static_cast<std::uint32_t>(parts_.size());
  const double width = box.max[0] - box.min[0], height = box.max[1] - box.min[1];
  Part part{.box = box,
            .points = static_cast<double>(sample.size()) * each,
            .first = windows_.size(),
            .axis = width >= height ? 0U : 1U};
  const double low = box.min[part.axis], high = box.max[part.axis];
  part.middle = low + 0.5 * (high - low);
  parts_.push_back(part);
  if (sample.size() <= max_sample || depth == kDeepestTree ||
      !(low < part.middle && part.middle < high)) {
    windows_.push_back(number);
  } else {
    const auto cut = std::partition(sample.begin(), sample.end(),
                                    [&](const Point2& p) { return p[part.axis] < part.middle; });
    const auto before = static_cast<std::size_t>(cut - sample.begin());
    StoredBox half = box;
    half.max[part.axis] = part.middle;
    const std::uint32_t below = split(half, sample.first(before), each, max_sample, depth + 1);
    half = box;
    half.min[part.axis] = part.middle;
    const std::uint32_t above = split(half, sample.subspan(before), each, max_sample, depth + 1);
    parts_[number].below = below;
    parts_[number].above = above;
  }
  parts_[number].end = windows_.size();
  return number;
}

std::size_t WindowTree::window_of(const Point2& place) const {
  std::uint32_t at = 0;
  while (!parts_[at].is_window()) {
    const Part& part = parts_[at];
    at = place[part.axis] < part.middle ? part.below : part.above;
  }
  return parts_[at].first;
}

}  // namespace terrace::terrain
