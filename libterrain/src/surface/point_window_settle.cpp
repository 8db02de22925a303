// SPDX-License-Identifier: Apache-2.0
// What a window still lacks: see PointWindow::load().
#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>

#include "surface/point_window.hpp"

namespace terrace::terrain {
namespace {

constexpr std::uint32_t kNoOpen = 0xFFFFFFFF;
/// Few, so that hardly more are looked at than lie near a circle's border; but boxes cost too.
constexpr std::size_t kPointsPerGroup = 16;
/// Share of the circles reaching over the border that a wider border is to hold.
constexpr double kWidened = 0.95;
/// Each widening is at most this share of the window's longer side.
constexpr double kMostWidened = 0.03;
constexpr unsigned kMostTimesWidened = 3;
/// Clusters that most suspects may meet lie within this share of the window's sides.
constexpr double kNear = 0.05;
/// For these each point is looked for by itself.
constexpr std::size_t kFewSuspects = 12;

/// Whether a triangle, its corners counter-clockwise, meets a box; sometimes true where it does not
/// by a rounding.
bool meets(const std::array<Point2, 3>& corner, const StoredBox& box) {
  for (std::size_t k = 0; k < 2; ++k) {
    const auto [low, high] = std::minmax({corner[0][k], corner[1][k], corner[2][k]});
    if (low > box.max[k] || high < box.min[k]) return false;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    // Seen from outside, the inside is to the right of a side.
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
  if ((state & kTriangleState) != kUnknown) return;
  if (holds(inner_, cover.bounds())) {
    state |= kCertain;
  } else {
    state |= kSuspect;
    suspects_.push_back({cover, triangle});
  }
}

void PointWindow::examine(tri::TriangleId triangle) {
  const auto next = triangulation_.neighbours(triangle);
  if (std::find(next.begin(), next.end(), tri::kNoTriangle) != next.end()) {
    hull_.push_back(triangle);
  }
  if (meets(corners(triangle), box_)) consider(triangle, circle(triangle));
}

void PointWindow::settle() {
  triangulation_.start_journal();
  examine_all();
  for (unsigned i = 0; i < kMostTimesWidened && widen(); ++i) store_.check_stop();
  while (add_missing()) {
    store_.check_stop();
    insert_taken();
    examine_changes();
  }
  triangulation_.stop_journal();
}

void PointWindow::examine_all() {
  states_.assign(triangulation_.triangle_slots(), kUnknown);
  for (const tri::TriangleId t : triangulation_.all_triangles()) examine(t);
  suspect_triangles_ = suspects_.size();
  find_suspect_hull();
}

void PointWindow::examine_changes() {
  triangulation_.take_changes(changes_);
  states_.resize(triangulation_.triangle_slots(), kUnknown);
  for (const tri::TriangleId t : changes_.removed_triangles) states_[tri::slot(t)] = kUnknown;
  suspects_.resize(suspect_triangles_);
  std::erase_if(suspects_, [&](const Suspect& suspect) {
    return (states_[tri::slot(suspect.triangle)] & kTriangleState) != kSuspect;
  });
  for (const tri::TriangleId t : changes_.added_triangles) examine(t);
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
      if (next[i] != tri::kNoTriangle || (states_[tri::slot(t)] & kHullEdge << i) != 0) continue;
      const CircleCover cover = CircleCover::of_plane(corner[(i + 1) % 3], corner[(i + 2) % 3]);
      if (cover.meets(box_)) {
        suspects_.push_back({cover, t, static_cast<std::uint8_t>(i)});
      }
    }
  }
}

bool PointWindow::widen() {
  reaches_.clear();
  for (const Suspect& suspect : suspects_) {
    if (suspect.cover.has_plane) continue;
    const StoredBox bounds = suspect.cover.bounds();
    double reach = 0;
    for (std::size_t k = 0; k < 2; ++k) {
      reach = std::max({reach, inner_.min[k] - bounds.min[k], bounds.max[k] - inner_.max[k]});
    }
    reaches_.push_back(reach);
  }
  if (reaches_.size() < kFewSuspects) return false;
  const auto at = reaches_.begin() +
                  static_cast<std::ptrdiff_t>(kWidened * static_cast<double>(reaches_.size() - 1));
  std::nth_element(reaches_.begin(), at, reaches_.end());
  const double most = kMostWidened * std::max(box_.max[0] - box_.min[0], box_.max[1] - box_.min[1]);
  // A little more, for rounding.
  const double more = std::min(*at * (1 + 1e-6), most);
  if (!(more > 0)) return false;
  grow_inner(
      {{inner_.min[0] - more, inner_.min[1] - more}, {inner_.max[0] + more, inner_.max[1] + more}});
  insert_taken();
  examine_changes();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < suspects_.size(); ++i) {
    const Suspect& suspect = suspects_[i];
    if (i < suspect_triangles_ && holds(inner_, suspect.cover.bounds())) {
      std::uint8_t& state = states_[tri::slot(suspect.triangle)];
      state = static_cast<std::uint8_t>((state & ~kTriangleState) | kCertain);
    } else {
      suspects_[kept++] = suspect;
    }
  }
  suspect_triangles_ -= suspects_.size() - kept;
  suspects_.resize(kept);
  return true;
}

bool PointWindow::add_missing() {
  if (triangulation_.triangle_count() == 0) {
    // Points on one line, or fewer than three: any other may make a triangle of them.
    while (true) {
      take_nearest(std::max<std::size_t>(64, triangulation_.vertex_count()));
      if (!places_.empty()) return true;
      constexpr std::size_t kAtOnce = 64;
      chosen_.clear();
      for (std::uint32_t k = 0; k < frontier_.open().size() && k < kAtOnce; ++k) {
        chosen_.push_back(k);
      }
      if (!read_missing()) return false;
      if (!places_.empty()) return true;
    }
  }
  // What most suspects meet of the clusters that were not read lies near.
  StoredBox wide = inner_;
  for (std::size_t k = 0; k < 2; ++k) {
    const double more = kNear * (inner_.max[k] - inner_.min[k]);
    wide.min[k] -= more;
    wide.max[k] += more;
  }
  open_near_.clear();
  const auto open = frontier_.open();
  for (std::uint32_t k = 0; k < open.size(); ++k) {
    if (open[k].box.meets(wide)) open_near_.push_back(k);
  }
  chosen_.clear();
  for (const Suspect& suspect : suspects_) {
    if (find_missing(suspect, holds(wide, suspect.cover.bounds()))) continue;
    std::uint8_t& state = states_[tri::slot(suspect.triangle)];
    if (suspect.edge == Suspect::kNone) {
      state = static_cast<std::uint8_t>((state & ~kTriangleState) | kCertain);
    } else {
      state = static_cast<std::uint8_t>(state | kHullEdge << suspect.edge);
    }
  }
  // Clusters are read to look into them: what they hold is found in the next round.
  const bool has_read = read_missing();
  return has_read || !places_.empty();
}

void PointWindow::add_groups(std::size_t begin, std::size_t count) {
  constexpr double kAll = std::numeric_limits<double>::infinity();
  StoredBox box{{kAll, kAll}, {-kAll, -kAll}};
  const std::span<Pending> points(pending_.data() + begin, count);
  for (const Pending& p : points) {
    for (std::size_t k = 0; k < 2; ++k) {
      box.min[k] = std::min(box.min[k], p.place[k]);
      box.max[k] = std::max(box.max[k], p.place[k]);
    }
  }
  const std::size_t at = groups_.size();
  groups_.push_back({box, begin, count, at + 1});
  if (count <= kPointsPerGroup) return;
  groups_[at].count = 0;
  const std::size_t axis = box.max[0] - box.min[0] >= box.max[1] - box.min[1] ? 0 : 1;
  const std::size_t half = count / 2;
  std::nth_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(half), points.end(),
                   [axis](const Pending& a, const Pending& b) {
                     return std::pair(a.place[axis], a.origin.index) <
                            std::pair(b.place[axis], b.origin.index);
                   });
  add_groups(begin, half);
  add_groups(begin + half, count - half);
  groups_[at].next = groups_.size();
}

void PointWindow::part(Outer& outer) {
  if (outer.first_group != outer.end_group) return;
  outer.first_group = groups_.size();
  add_groups(outer.begin, outer.count);
  outer.end_group = groups_.size();
}

bool PointWindow::find_missing(const Suspect& suspect, bool is_near) {
  const CircleCover& cover = suspect.cover;
  const StoredBox bounds = cover.bounds();
  // Take the point farthest inside among those that were read: it leaves the smallest remainder.
  std::size_t point = pending_.size();
  double depth = std::numeric_limits<double>::infinity();
  const auto look_at_point = [&](std::size_t at) {
    const Pending& p = pending_[at];
    if (p.origin.cluster == kNowhere) return;  // taken
    const StoredBox box{p.place, p.place};
    const double d = cover.depth(box);
    if (point < pending_.size() && !(d < depth)) return;
    if (!bounds.meets(box) || !cover.meets(box)) return;
    point = at;
    depth = d;
  };
  const auto may_hold = [&](const StoredBox& box) {
    return bounds.meets(box) && cover.meets(box) &&
           !(point < pending_.size() && cover.least_depth(box) > depth);
  };
  for (Outer& outer : outer_) {
    if (!may_hold(outer.box)) continue;
    part(outer);
    for (std::size_t g = outer.first_group; g < outer.end_group;) {
      const Group& group = groups_[g];
      const bool looks = may_hold(group.box);
      g = looks ? g + 1 : group.next;
      if (!looks) continue;
      for (std::size_t k = 0; k < group.count; ++k) look_at_point(group.begin + k);
    }
  }
  if (point < pending_.size()) {
    take(pending_[point]);
    return true;
  }
  // Else of the clusters that may hold some one of the highest level.
  const auto open = frontier_.open();
  std::uint32_t best = kNoOpen;
  const auto look_at = [&](std::uint32_t k) {
    if (best != kNoOpen && open[k].level < open[best].level) return;
    if (!bounds.meets(open[k].box) || !cover.meets(open[k].box)) return;
    const double d = cover.depth(open[k].box);
    if (best != kNoOpen && open[k].level == open[best].level && !(d < depth)) return;
    best = k;
    depth = d;
  };
  if (is_near) {
    for (const std::uint32_t k : open_near_) look_at(k);
  } else {
    for (std::uint32_t k = 0; k < open.size(); ++k) look_at(k);
  }
  if (best == kNoOpen) return false;
  chosen_.push_back(best);
  if (cover.has_plane && !cover.has_disk && cover.plane.grazes(open[best].box)) {
    // Hardly anything lies beyond this edge of the hull, but on its line: on a straight border,
    // much. None of that makes the plane smaller, so all of it has to be looked into.
    for (std::uint32_t k = 0; k < open.size(); ++k) {
      if (open[k].level == open[best].level && cover.meets(open[k].box)) chosen_.push_back(k);
    }
  }
  return true;
}

bool PointWindow::read_missing() {
  if (chosen_.empty()) return false;
  std::sort(chosen_.begin(), chosen_.end());
  chosen_.erase(std::unique(chosen_.begin(), chosen_.end()), chosen_.end());
  frontier_.read(chosen_, [this](const stream::StoreQuery::Node& node) { take(node); });
  return true;
}

}  // namespace terrace::terrain
