// SPDX-License-Identifier: GPL-3.0-or-later
// What a window still lacks: see PointWindow::load().
#include <algorithm>
#include <cstddef>
#include <limits>

#include "surface/point_window.hpp"

namespace terrace::terrain {
namespace {

constexpr std::uint32_t kNoTriangle = 0xFFFFFFFF;

/// Whether a triangle, its corners counter-clockwise, meets a box; sometimes true where it does not
/// by a rounding.
bool meets(const std::array<Point2, 3>& corner, const StoredBox& box) {
  for (std::size_t k = 0; k < 2; ++k) {
    const auto [low, high] = std::minmax({corner[0][k], corner[1][k], corner[2][k]});
    if (low > box.max[k] || high < box.min[k]) return false;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    // Of the sides seen from outside, the inside is to the right.
    if (!HalfPlane{corner[(i + 1) % 3], corner[i]}.meets(box)) return false;
  }
  return true;
}

bool holds(const StoredBox& outer, const StoredBox& inner) {
  return inner.min[0] >= outer.min[0] && inner.min[1] >= outer.min[1] &&
         inner.max[0] <= outer.max[0] && inner.max[1] <= outer.max[1];
}

}  // namespace

CircleCover PointWindow::circle(tri::TriangleId triangle) const {
  const std::array<Point2, 3> corner = corners(triangle);
  return CircleCover::of_triangle(corner[0], corner[1], corner[2]);
}

void PointWindow::consider(tri::TriangleId triangle, const CircleCover& cover) {
  std::uint8_t& state = states_[tri::slot(triangle)];
  if (state != kUnknown) return;
  if (holds(inner_, cover.bounds())) {
    state = kCertain;
  } else {
    state = kSuspect;
    suspects_.push_back({cover, triangle});
  }
}

void PointWindow::examine(tri::TriangleId triangle) {
  const auto next = triangulation_.neighbours(triangle);
  if (std::find(next.begin(), next.end(), tri::kNoTriangle) != next.end()) {
    hull_.push_back(triangle);
  }
  if (reach_ == Reach::kTriangles) {
    if (meets(corners(triangle), box_)) consider(triangle, circle(triangle));
    return;
  }
  const CircleCover cover = circle(triangle);
  if (!cover.meets(box_)) {
    if (meets(corners(triangle), box_)) consider(triangle, cover);
    return;
  }
  consider(triangle, cover);
  for (const tri::TriangleId t : next) {
    if (t != tri::kNoTriangle && states_[tri::slot(t)] == kUnknown) consider(t, circle(t));
  }
}

void PointWindow::examine_all() {
  for (const tri::TriangleId t : triangulation_.all_triangles()) examine(t);
  suspect_triangles_ = suspects_.size();
  find_suspect_hull();
}

void PointWindow::examine_changes() {
  triangulation_.take_changes(changes_);
  for (const tri::TriangleId t : changes_.removed_triangles) {
    states_[tri::slot(t)] = kUnknown;
    hull_certain_[tri::slot(t)] = 0;
  }
  suspects_.resize(suspect_triangles_);
  std::erase_if(suspects_, [&](const Suspect& suspect) {
    return states_[tri::slot(suspect.triangle)] != kSuspect;
  });
  for (const tri::TriangleId t : changes_.added_triangles) examine(t);
  // Of what stood beside new triangles, some have circles that meet the box and so name these.
  if (reach_ == Reach::kCircles) {
    for (const tri::TriangleId t : changes_.added_triangles) {
      if (states_[tri::slot(t)] != kUnknown) continue;
      for (const tri::TriangleId other : triangulation_.neighbours(t)) {
        if (other != tri::kNoTriangle && circle(other).meets(box_)) consider(t, circle(t));
      }
    }
  }
  suspect_triangles_ = suspects_.size();
  find_suspect_hull();
}

void PointWindow::find_suspect_hull() {
  std::sort(hull_.begin(), hull_.end());
  hull_.erase(std::unique(hull_.begin(), hull_.end()), hull_.end());
  std::erase_if(hull_, [&](tri::TriangleId t) {
    if (!triangulation_.alive(t)) return true;
    const auto next = triangulation_.neighbours(t);
    return std::find(next.begin(), next.end(), tri::kNoTriangle) == next.end();
  });
  for (const tri::TriangleId t : hull_) {
    const auto next = triangulation_.neighbours(t);
    const std::array<Point2, 3> corner = corners(t);
    for (std::size_t i = 0; i < 3; ++i) {
      if (next[i] != tri::kNoTriangle || (hull_certain_[tri::slot(t)] >> i & 1) != 0) continue;
      const CircleCover cover = CircleCover::of_plane(corner[(i + 1) % 3], corner[(i + 2) % 3]);
      if (cover.meets(box_) || (reach_ == Reach::kCircles && circle(t).meets(box_))) {
        suspects_.push_back({cover, t, static_cast<std::uint8_t>(i)});
      }
    }
  }
}

bool PointWindow::add_missing() {
  if (triangulation_.triangle_count() == 0) {
    // Points on one line, or fewer than three: any other may make a triangle of them.
    while (true) {
      for (Group& group : groups_) {
        while (group.count > 0) move_pending(group, group.begin);
      }
      if (!taken_.empty()) return true;
      constexpr std::size_t kAtOnce = 64;
      chosen_.clear();
      for (std::uint32_t k = 0; k < frontier_.open().size() && k < kAtOnce; ++k) {
        chosen_.push_back(k);
      }
      if (!read_missing()) return false;
    }
  }
  // Most circles reach a little over the border; for these only what is near is looked at.
  StoredBox wide = inner_;
  for (std::size_t k = 0; k < 2; ++k) {
    const double more = 0.1 * (inner_.max[k] - inner_.min[k]);
    wide.min[k] -= more;
    wide.max[k] += more;
  }
  gather_near(wide);
  chosen_.clear();
  for (const Suspect& suspect : suspects_) {
    if (find_missing(suspect, holds(wide, suspect.cover.bounds()))) continue;
    const std::uint32_t at = tri::slot(suspect.triangle);
    if (suspect.edge == Suspect::kNone) {
      states_[at] = kCertain;
    } else {
      hull_certain_[at] = static_cast<std::uint8_t>(hull_certain_[at] | 1U << suspect.edge);
    }
  }
  // Clusters are read to look into them: what they hold is found in the next round.
  const bool has_read = read_missing();
  return has_read || !taken_.empty();
}

void PointWindow::gather_near(const StoredBox& wide) {
  constexpr double kAll = std::numeric_limits<double>::infinity();
  StoredBox around{{kAll, kAll}, {-kAll, -kAll}};
  for (const Suspect& suspect : suspects_) {
    const StoredBox bounds = suspect.cover.bounds();
    if (!holds(wide, bounds)) continue;
    for (std::size_t k = 0; k < 2; ++k) {
      around.min[k] = std::min(around.min[k], bounds.min[k]);
      around.max[k] = std::max(around.max[k], bounds.max[k]);
    }
  }
  open_near_.clear();
  points_near_.clear();
  const auto open = frontier_.open();
  for (std::uint32_t k = 0; k < open.size(); ++k) {
    if (open[k].box.meets(around)) open_near_.push_back(k);
  }
  for (std::size_t g = 0; g < groups_.size();) {
    const Group& group = groups_[g];
    const bool meets = group.box.meets(around);
    g = meets ? g + 1 : group.next;
    if (!meets) continue;
    for (std::size_t at = group.begin; at < group.begin + group.count; ++at) {
      const Pending& p = pending_[at];
      if (p.origin.cluster == kNoTriangle || !around.contains({p.place[0], p.place[1], 0}))
        continue;
      points_near_.emplace_back(p.place[0], at);
    }
  }
  std::sort(points_near_.begin(), points_near_.end());
}

bool PointWindow::find_missing(const Suspect& suspect, bool is_near) {
  const CircleCover& cover = suspect.cover;
  const StoredBox bounds = cover.bounds();
  // Of points that were read the one farthest inside: what is left afterwards is smallest.
  std::size_t point = pending_.size();
  double depth = std::numeric_limits<double>::infinity();
  const auto look_at_point = [&](std::size_t at) {
    const Pending& p = pending_[at];
    if (p.origin.cluster == kNoTriangle) return;  // taken
    const StoredBox box{p.place, p.place};
    const double d = cover.depth(box);
    if (point < pending_.size() && !(d < depth)) return;
    if (!bounds.meets(box) || !cover.meets(box)) return;
    point = at;
    depth = d;
  };
  if (is_near) {
    auto one = std::lower_bound(points_near_.begin(), points_near_.end(),
                                std::pair(bounds.min[0], std::size_t{0}));
    for (; one != points_near_.end() && one->first <= bounds.max[0]; ++one) {
      look_at_point(one->second);
    }
  } else {
    for (std::size_t g = 0; g < groups_.size();) {
      const Group& group = groups_[g];
      const bool may_hold = bounds.meets(group.box) && cover.meets(group.box) &&
                            !(point < pending_.size() && cover.least_depth(group.box) > depth);
      g = may_hold ? g + 1 : group.next;
      if (!may_hold) continue;
      for (std::size_t k = 0; k < group.count; ++k) look_at_point(group.begin + k);
    }
  }
  if (point < pending_.size()) {
    taken_.push_back(pending_[point]);
    pending_[point].origin.cluster = kNoTriangle;
    return true;
  }
  // Else of the clusters that may hold some one of the highest level.
  const auto open = frontier_.open();
  std::uint32_t best = kNoTriangle;
  const auto look_at = [&](std::uint32_t k) {
    if (best != kNoTriangle && open[k].level < open[best].level) return;
    if (!bounds.meets(open[k].box) || !cover.meets(open[k].box)) return;
    const double d = cover.depth(open[k].box);
    if (best != kNoTriangle && open[k].level == open[best].level && !(d < depth)) return;
    best = k;
    depth = d;
  };
  if (is_near) {
    for (const std::uint32_t k : open_near_) look_at(k);
  } else {
    for (std::uint32_t k = 0; k < open.size(); ++k) look_at(k);
  }
  if (best == kNoTriangle) return false;
  chosen_.push_back(best);
  return true;
}

bool PointWindow::read_missing() {
  if (chosen_.empty()) return false;
  std::sort(chosen_.begin(), chosen_.end());
  chosen_.erase(std::unique(chosen_.begin(), chosen_.end()), chosen_.end());
  frontier_.read(chosen_, [this](const StoreWindow::Node& node) { take(node); });
  return true;
}

}  // namespace terrace::terrain
