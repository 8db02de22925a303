// SPDX-License-Identifier: Apache-2.0
#include "surface/window_tree.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace terrace::terrain {
namespace {

constexpr std::uint64_t kMaxCounted = std::uint64_t{1} << 18;
/// A view's share of a level is unknown, so it reads finer levels until it has this many points.
constexpr std::size_t kFewestCounted = std::size_t{1} << 14;
/// Limit on halvings of the store's area; only coincident points need more.
constexpr unsigned kDeepestTree = 48;

}  // namespace

CoarsePlaces coarse_places(const stream::Store& store, unsigned level) {
  unsigned counted = level;
  while (counted < store.top() && store.levels()[counted].points > kMaxCounted) ++counted;
  constexpr double kAll = std::numeric_limits<double>::infinity();
  WindowPoints read;
  StoreWindow window(store);
  const auto read_counted = [&] {
    window.points({{-kAll, -kAll}, {kAll, kAll}}, read, counted);
    return read.positions.size();
  };
  while (read_counted() < kFewestCounted && store.condition() != nullptr && counted > level) {
    --counted;
  }
  CoarsePlaces coarse;
  coarse.places.reserve(read.positions.size());
  for (const stream::Point3& p : read.positions) coarse.places.push_back(flat(p));
  coarse.each = static_cast<double>(store.levels()[level].points) /
                static_cast<double>(std::max<std::uint64_t>(store.levels()[counted].points, 1));
  return coarse;
}

std::vector<WindowTree::Counted> WindowTree::counted_points(const stream::Store& store,
                                                            const WantedClusters& wanted) {
  stream::StoreQuery query(store);
  std::vector<Point2> fewer, more;
  unsigned counted = store.top() + 1;
  while (counted > wanted.finest() && more.size() <= kMaxCounted) {
    std::swap(fewer, more);
    more.clear();
    query.descend(
        --counted,
        [&](unsigned at, const stream::StoreQuery::Branch& branch) {
          return more.size() <= kMaxCounted && wanted(at, branch.box);
        },
        [&](const stream::StoreQuery::Node& node) {
          for (const stream::Point3& p : node.positions) more.push_back(flat(p));
        });
  }
  if (more.size() > kMaxCounted && !fewer.empty()) {
    std::swap(fewer, more);
    ++counted;
  }
  const auto points_of = [&](unsigned level) {
    return static_cast<double>(std::max<std::uint64_t>(store.levels()[level].points, 1));
  };
  std::vector<Counted> sample;
  sample.reserve(more.size());
  for (const Point2& p : more) {
    const unsigned finest = wanted.finest_at(p);
    sample.push_back({p, points_of(finest) / points_of(std::max(finest, counted))});
  }
  return sample;
}

WindowTree::WindowTree(const stream::Store& store, const WantedClusters& wanted,
                       std::size_t points) {
  const StoredBox box = flat(store.bounds());
  if (wanted.is_mixed()) {
    std::vector<Counted> sample = counted_points(store, wanted);
    split(box, sample, 1, static_cast<double>(points), 0);
    return;
  }
  const CoarsePlaces coarse = coarse_places(store, wanted.level());
  const double each = coarse.each;
  std::vector<Counted> sample;
  sample.reserve(coarse.places.size());
  for (const Point2& place : coarse.places) sample.push_back({place});
  // A level without points has nothing to divide.
  const double sampled = each > 0 ? static_cast<double>(points) / each : 0.0;
  const auto max_sample = static_cast<std::size_t>(
      std::clamp(sampled, 1.0, static_cast<double>(std::max<std::size_t>(sample.size(), 1))));
  split(box, sample, each, static_cast<double>(max_sample), 0);
}

std::uint32_t WindowTree::split(const StoredBox& box, std::span<Counted> sample, double each,
                                double max_sample, unsigned depth) {
  const auto number = static_cast<std::uint32_t>(parts_.size());
  const double width = box.max[0] - box.min[0], height = box.max[1] - box.min[1];
  double weight = 0;
  for (const Counted& one : sample) weight += one.weight;
  Part part{.box = box,
            .points = weight * each,
            .first = windows_.size(),
            .axis = width >= height ? 0U : 1U};
  const double low = box.min[part.axis], high = box.max[part.axis];
  part.middle = low + 0.5 * (high - low);
  parts_.push_back(part);
  if (weight <= max_sample || sample.size() <= 1 || depth == kDeepestTree ||
      !(low < part.middle && part.middle < high)) {
    windows_.push_back(number);
  } else {
    const auto cut = std::partition(sample.begin(), sample.end(), [&](const Counted& one) {
      return one.place[part.axis] < part.middle;
    });
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
