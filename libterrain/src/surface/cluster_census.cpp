// SPDX-License-Identifier: Apache-2.0
#include "surface/cluster_census.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace terrace::terrain {
namespace {

constexpr std::size_t kMostCensusBytes = std::size_t{6} << 20;
constexpr std::size_t kMostSome = 12;

bool meets(const StoredBox& box, const stream::Box3& other) {
  return box.min[0] <= other.max[0] && box.max[0] >= other.min[0] && box.min[1] <= other.max[1] &&
         box.max[1] >= other.min[1];
}

bool holds(const StoredBox& box, const stream::Box3& other) {
  return box.min[0] <= other.min[0] && box.max[0] >= other.max[0] && box.min[1] <= other.min[1] &&
         box.max[1] >= other.max[1];
}

/// Share of `other`, which meets `box`, that lies inside it; 1 if `other` has no area.
double share_inside(const StoredBox& box, const stream::Box3& other) {
  double share = 1.0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double length = other.max[axis] - other.min[axis];
    const double inside =
        std::min(box.max[axis], other.max[axis]) - std::max(box.min[axis], other.min[axis]);
    if (length > 0.0) share *= inside / length;
  }
  return share;
}

}  // namespace

ClusterCensus::ClusterCensus(const stream::Store& store) : store_(store) {
  fill(root_, store.root());
}

void ClusterCensus::fill(Node& node, stream::ClusterId id) {
  const unsigned level = stream::level_of(id);
  store_.read(id, points_);
  node.id = id;
  std::swap(node.positions, points_.positions);
  node.entries.clear();
  for (std::size_t i = 0; i < node.positions.size(); ++i) {
    for (unsigned below = 0; below < level; ++below) {
      const std::uint64_t ordinal = points_.children[i * level + below];
      const stream::ClusterSummary summary =
          store_.record(stream::cluster_id(below, ordinal)).summary;
      node.entries.push_back({summary.box, ordinal, summary.descendants});
    }
    if (level == 0) {
      // A store of one block: its points are the root's.
      Entry entry{.box = {}, .ordinal = 0, .descendants = 1};
      entry.box.include(node.positions[i]);
      node.entries.push_back(entry);
    }
  }
}

const ClusterCensus::Node& ClusterCensus::node(stream::ClusterId id) {
  if (id == root_.id) return root_;
  const auto key = static_cast<std::uint64_t>(id);
  if (const auto found = by_id_.find(key); found != by_id_.end()) {
    nodes_.splice(nodes_.begin(), nodes_, found->second);
    return nodes_.front();
  }
  while (held_bytes_ > kMostCensusBytes && !nodes_.empty()) {
    held_bytes_ -= nodes_.back().bytes();
    by_id_.erase(static_cast<std::uint64_t>(nodes_.back().id));
    nodes_.pop_back();
  }
  // Until it is whole it is in no list, so damage leaves nothing behind.
  Nodes fresh(1);
  fill(fresh.front(), id);
  held_bytes_ += fresh.front().bytes();
  nodes_.splice(nodes_.begin(), fresh);
  by_id_[key] = nodes_.begin();
  return nodes_.front();
}

template <class Take, class Opens>
void ClusterCensus::walk(const StoredBox& box, const Take& take, const Opens& opens) {
  open_.assign(1, root_.id);
  while (!open_.empty()) {
    const Node& at = node(open_.back());
    open_.pop_back();
    const unsigned level = stream::level_of(at.id);
    const unsigned headed = std::max(level, 1U);
    for (std::size_t i = 0; i < at.positions.size(); ++i) {
      // What a point heads on a level lies within what it heads on the level above.
      for (unsigned below = headed; below-- > 0;) {
        const Entry& entry = at.entries[i * headed + below];
        if (!meets(box, entry.box)) break;
        if (below == 0 || holds(box, entry.box)) {
          if (!take(at.positions[i], entry)) return;
          break;
        }
        if (!opens(entry)) break;
        open_.push_back(stream::cluster_id(below, entry.ordinal));
      }
    }
  }
}

double ClusterCensus::count(const StoredBox& box, double limit) {
  double sum = 0.0;
  walk(
      box,
      [&](const stream::Point3&, const Entry& entry) {
        sum += static_cast<double>(entry.descendants) * share_inside(box, entry.box);
        return sum <= limit;
      },
      [](const Entry&) { return true; });
  return sum;
}

std::optional<ClusterCensus::Heights> ClusterCensus::heights(const StoredBox& box) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Heights found{kFar, -kFar, {}};
  walk(
      box,
      [&](const stream::Point3& head, const Entry& entry) {
        found.low = std::min(found.low, entry.box.min[2]);
        found.high = std::max(found.high, entry.box.max[2]);
        if (found.some.size() < kMostSome && box.contains(head)) found.some.push_back(head);
        return true;
      },
      [&](const Entry& entry) {
        // What lies below cannot widen the range.
        const bool known = found.low <= entry.box.min[2] && found.high >= entry.box.max[2];
        return !(known && found.some.size() == kMostSome);
      });
  if (found.low > found.high) return std::nullopt;
  return found;
}

}  // namespace terrace::terrain
