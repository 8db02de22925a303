// SPDX-License-Identifier: Apache-2.0
// Finds what a window still lacks: see PointWindow::load().
#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>

#include <terrace/tri/predicates.hpp>

#include "surface/point_window.hpp"

namespace terrace::terrain {
namespace {

/// Small, so that few points are tested that are not near a circle's border; but boxes cost time
/// too.
constexpr std::size_t kPointsPerGroup = 16;
/// Share of the circles crossing the border that a wider border should contain.
constexpr double kWidened = 0.95;
/// Limit of each widening as a share of the window's longer side.
constexpr double kMostWidened = 0.03;
constexpr unsigned kMostTimesWidened = 3;
/// The number of clusters read together for a suspect doubles after this many rounds, at most this
/// often.
constexpr unsigned kRoundsToDouble = 8, kMostDoublings = 8;
/// Up to this many suspects, each point is searched separately.
constexpr std::size_t kFewSuspects = 12;
/// Looks are added to the count of all windows in batches of this size.
constexpr std::uint64_t kLooksAtOnce = 1024;

}  // namespace

bool triangle_meets(const std::array<Point2, 3>& corner, const StoredBox& box) {
  for (std::size_t k = 0; k < 2; ++k) {
    const auto [low, high] = std::minmax({corner[0][k], corner[1][k], corner[2][k]});
    if (low > box.max[k] || high < box.min[k]) return false;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const Point2 &a = corner[i], &b = corner[(i + 1) % 3];
    const Point2 leftmost{b[1] > a[1] ? box.min[0] : box.max[0],
                          b[0] > a[0] ? box.max[1] : box.min[1]};
    if (tri::orientation(a, b, leftmost) < 0) return false;
  }
  return true;
}

CircleCover PointWindow::circle(tri::TriangleId triangle) const {
  const std::array<Point2, 3> corner = corners(triangle);
  return CircleCover::of_triangle(corner[0], corner[1], corner[2]);
}

void PointWindow::examine(tri::TriangleId triangle) {
  std::uint8_t& state = states_[tri::slot(triangle)];
  const CircleCover cover = circle(triangle);
  if (inner_.holds(cover.bounds())) {
    state = kCertain;
  } else if (triangle_meets(corners(triangle), box_)) {
    state = kSuspect;
    suspects_.push_back({cover, triangle});
  } else {
    state = kUnknown;
  }
}

void PointWindow::settle() {
  clusters_at_once_ = 1;
  triangulation_.start_journal();
  examine_all();
  for (unsigned i = 0; i < kMostTimesWidened && widen(); ++i) store_.check_stop();
  for (unsigned round = 1; add_missing(); ++round) {
    // Where clusters have no missing points, more of them are read together.
    clusters_at_once_ = std::size_t{1} << std::min(round / kRoundsToDouble, kMostDoublings);
    store_.check_stop();
    insert_taken();
    examine_changes();
  }
  triangulation_.stop_journal();
}

void PointWindow::find_hull() {
  if (triangulation_.triangle_count() == 0) return;
  tri::VertexId least = tri::kNoVertex;
  Point2 place{};
  for (const tri::VertexId v : triangulation_.all_vertices()) {
    const Point2 p = triangulation_.point(v);
    if (least != tri::kNoVertex && !(p < place)) continue;
    least = v;
    place = p;
  }
  // Rotates around a corner until it finds the hull edge that begins there.
  tri::TriangleId t = triangulation_.triangle_at(least);
  tri::VertexId about = least;
  do {
    while (true) {
      const auto corner = triangulation_.vertices(t);
      const auto at =
          static_cast<std::size_t>(std::find(corner.begin(), corner.end(), about) - corner.begin());
      const tri::TriangleId next = triangulation_.neighbours(t)[(at + 2) % 3];
      if (next == tri::kNoTriangle) {
        about = corner[(at + 1) % 3];
        break;
      }
      t = next;
    }
    hull_.push_back(t);
  } while (about != least);
}

void PointWindow::examine_all() {
  // While inner_ contains all vertices, a circle that leaves it contains places outside the hull.
  // The triangles whose circles contain such a place are connected across edges to each other and
  // to the hull, like those that an insertion there would remove. So the others need no test.
  states_.assign(triangulation_.triangle_slots(), kCertain);
  find_hull();
  std::vector<tri::TriangleId> reached = hull_;
  if (triangulation_.vertex_count() <= kFirstPoints) {
    const auto all = triangulation_.all_triangles();
    reached.assign(all.begin(), all.end());
  }
  while (!reached.empty()) {
    const tri::TriangleId t = reached.back();
    reached.pop_back();
    if (state(t) != kCertain) continue;
    examine(t);
    if (state(t) == kCertain) continue;
    for (const tri::TriangleId next : triangulation_.neighbours(t)) {
      if (next != tri::kNoTriangle && state(next) == kCertain) reached.push_back(next);
    }
  }
  suspect_triangles_ = suspects_.size();
  find_suspect_hull();
}

void PointWindow::examine_changes() {
  triangulation_.take_changes(changes_);
  states_.resize(triangulation_.triangle_slots(), kUnknown);
  for (const tri::TriangleId t : changes_.removed_triangles) states_[tri::slot(t)] = kUnknown;
  suspects_.resize(suspect_triangles_);
  std::erase_if(suspects_,
                [&](const Suspect& suspect) { return state(suspect.triangle) != kSuspect; });
  for (const tri::TriangleId t : changes_.added_triangles) {
    const auto next = triangulation_.neighbours(t);
    if (std::find(next.begin(), next.end(), tri::kNoTriangle) != next.end()) hull_.push_back(t);
    examine(t);
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
  // Slightly more, for rounding.
  const double more = std::min(*at * (1 + 1e-6), most);
  if (!(more > 0)) return false;
  grow_inner(inner_.widened(more));
  insert_taken();
  examine_changes();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < suspects_.size(); ++i) {
    const Suspect& suspect = suspects_[i];
    if (i < suspect_triangles_ && inner_.holds(suspect.cover.bounds())) {
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
    // With fewer than three points, or collinear points, any other point may form a triangle.
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
  make_trees();
  chosen_.clear();
  for (const Suspect& suspect : suspects_) {
    const bool is_missing = find_missing(suspect);
    if (looks_ >= kLooksAtOnce) takes_too_long_ = voids_->count_looks(std::exchange(looks_, 0));
    if (takes_too_long_) return false;
    if (is_missing) continue;
    std::uint8_t& state = states_[tri::slot(suspect.triangle)];
    if (suspect.edge == Suspect::kNone) {
      state = static_cast<std::uint8_t>((state & ~kTriangleState) | kCertain);
    } else {
      state = static_cast<std::uint8_t>(state | kHullEdge << suspect.edge);
    }
  }
  // Clusters are only read now; their points are found in the next round.
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
  if (outer.is_parted) return;
  outer.is_parted = true;
  outer.first_group = groups_.size();
  const auto begin = pending_.begin() + static_cast<std::ptrdiff_t>(outer.begin);
  const auto end = begin + static_cast<std::ptrdiff_t>(outer.count);
  const auto taken =
      std::partition(begin, end, [](const Pending& p) { return p.origin.cluster != kNowhere; });
  if (taken != begin) add_groups(outer.begin, static_cast<std::size_t>(taken - begin));
  outer.end_group = groups_.size();
}

void PointWindow::make_trees() {
  if (read_in_trees_ == read_.size()) return;
  read_in_trees_ = read_.size();
  std::vector<BoxTree::Item>& outer = outer_tree_.start();
  for (std::uint32_t k = 0; k < outer_.size(); ++k) {
    if (!inner_.holds(outer_[k].box)) outer.push_back({outer_[k].box, k});
  }
  outer_tree_.build();
  std::vector<BoxTree::Item>& open = open_tree_.start();
  for (std::uint32_t k = 0; k < frontier_.open().size(); ++k) {
    open.push_back({frontier_.open()[k].box, k});
  }
  open_tree_.build();
}

bool PointWindow::find_missing(const Suspect& suspect) {
  const CircleCover& cover = suspect.cover;
  const std::array<Point2, 3> corner = corners(suspect.triangle);
  const StoredBox bounds = cover.bounds();
  const Point2 &from = corner[(suspect.edge + 1) % 3], &to = corner[(suspect.edge + 2) % 3];
  const auto meets_cover = [&](const StoredBox& box) {
    ++looks_;
    if (!bounds.meets(box) || !cover.meets(box)) return false;
    if (suspect.edge == Suspect::kNone) return true;
    // On the line of a hull edge, only points between its ends are missing; a straight border has
    // many points on its line.
    const Point2 outermost{to[1] > from[1] ? box.max[0] : box.min[0],
                           to[0] > from[0] ? box.min[1] : box.max[1]};
    if (tri::orientation(from, to, outermost) < 0) return true;
    return StoredBox{{std::min(from[0], to[0]), std::min(from[1], to[1])},
                     {std::max(from[0], to[0]), std::max(from[1], to[1])}}
        .meets(box);
  };
  // Take the innermost of the points that were read: it leaves the smallest remainder.
  std::size_t point = pending_.size();
  double depth = std::numeric_limits<double>::infinity();
  const auto look_at_point = [&](std::size_t at) {
    Pending& p = pending_[at];
    if (p.origin.cluster == kNowhere) return;  // already taken
    // Twins of a corner may give it another height, but change nothing else.
    if (p.place == corner[0] || p.place == corner[1] || p.place == corner[2]) return take(p);
    const StoredBox box{p.place, p.place};
    const double d = cover.depth(box);
    if (point < pending_.size() && !(d < depth)) return;
    if (!meets_cover(box)) return;
    point = at;
    depth = d;
  };
  const auto may_hold = [&](const StoredBox& box) {
    return meets_cover(box) && !(point < pending_.size() && cover.least_depth(box) > depth);
  };
  outer_tree_.visit(may_hold, [&](std::uint32_t number) {
    Outer& outer = outer_[number];
    part(outer);
    for (std::size_t g = outer.first_group; g < outer.end_group;) {
      const Group& group = groups_[g];
      const bool looks = may_hold(group.box);
      g = looks ? g + 1 : group.next;
      if (!looks) continue;
      for (std::size_t k = 0; k < group.count; ++k) look_at_point(group.begin + k);
    }
  });
  if (point < pending_.size()) {
    take(pending_[point]);
    return true;
  }
  // Otherwise read clusters of the highest level that may contain some, those with most of the
  // cover.
  const auto open = frontier_.open();
  unsigned level = 0;
  by_distance_.clear();
  open_tree_.visit(meets_cover, [&](std::uint32_t k) {
    if (open[k].level < level) return;
    if (open[k].level > level) by_distance_.clear();
    level = open[k].level;
    by_distance_.emplace_back(cover.depth(open[k].box), k);
  });
  if (by_distance_.empty()) return false;
  std::size_t count = std::min(clusters_at_once_, by_distance_.size());
  const auto behind = by_distance_.begin() + static_cast<std::ptrdiff_t>(count);
  std::nth_element(by_distance_.begin(), behind - 1, by_distance_.end());
  const StoredBox& best = open[std::min_element(by_distance_.begin(), behind)->second].box;
  // Hardly any points are beyond an edge of the hull, but on a straight border many are on its
  // line. They do not make the half-plane smaller, so all such clusters must be read.
  if (cover.has_plane && !cover.has_disk && cover.plane.grazes(best)) count = by_distance_.size();
  for (std::size_t i = 0; i < count; ++i) {
    chosen_.push_back(static_cast<std::uint32_t>(by_distance_[i].second));
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
