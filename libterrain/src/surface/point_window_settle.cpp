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

/// Small groups avoid tests of points far from a circle's border, but each group's box costs time
/// too.
constexpr std::size_t kPointsPerGroup = 16;
/// Share of the circles crossing the border that a wider border should contain.
constexpr double kWidened = 0.95;
/// Limit of each widening as a share of the window's longer side.
constexpr double kMaxWidened = 0.03;
constexpr unsigned kMaxTimesWidened = 3;
/// The number of clusters read together for a suspect doubles after this many rounds, at most this
/// often.
constexpr unsigned kRoundsToDouble = 8, kMaxDoublings = 8;
/// With fewer suspects, a wider border does not pay off.
constexpr std::size_t kFewSuspects = 12;
/// Tested boxes are added to the count of all windows in batches of this size.
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

void PointWindow::examine(tri::TriangleId triangle) {
  State& state = states_[tri::slot(triangle)];
  const CircleCover cover = circle(triangle);
  if (inner_.covers(cover.bounds())) {
    state = State::certain;
  } else if (triangle_meets(corners(triangle), box_)) {
    state = State::suspect;
    suspects_.push_back({cover, triangle});
  } else {
    state = State::unknown;
  }
}

void PointWindow::settle() {
  clusters_at_once_ = 1;
  triangulation_.start_journal();
  examine_all();
  for (unsigned i = 0; i < kMaxTimesWidened && widen(); ++i) cloud_.store.check_stop();
  // With these corners, the hull is that of all points, so only circles can lack points. The
  // corners get their heights when their clusters are read.
  for (const Point2& corner : cloud_.hull.corners()) take_distant({corner, kUnknownHeight});
  insert_new_points();
  examine_changes();
  for (unsigned round = 1; add_missing(); ++round) {
    // Where clusters have no missing points, more of them are read together.
    clusters_at_once_ = std::size_t{1} << std::min(round / kRoundsToDouble, kMaxDoublings);
    cloud_.store.check_stop();
    insert_new_points();
    examine_changes();
  }
  triangulation_.stop_journal();
}

std::vector<tri::TriangleId> PointWindow::triangles_at_hull() const {
  std::vector<tri::TriangleId> found;
  if (triangulation_.triangle_count() == 0) return found;
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
    found.push_back(t);
  } while (about != least);
  return found;
}

void PointWindow::examine_all() {
  // As inner_ contains all vertices, a circle that leaves it contains places outside the hull.
  // The triangles whose circles contain such a place are connected across edges to each other and
  // to the hull, like those that an insertion there would remove. So the others need no test.
  states_.assign(triangulation_.triangle_slots(), State::certain);
  std::vector<tri::TriangleId> reached = triangles_at_hull();
  while (!reached.empty()) {
    const tri::TriangleId t = reached.back();
    reached.pop_back();
    if (states_[tri::slot(t)] != State::certain) continue;
    examine(t);
    if (states_[tri::slot(t)] == State::certain) continue;
    for (const tri::TriangleId next : triangulation_.neighbours(t)) {
      if (next != tri::kNoTriangle && states_[tri::slot(next)] == State::certain)
        reached.push_back(next);
    }
  }
}

void PointWindow::examine_changes() {
  triangulation_.take_changes(changes_);
  states_.resize(triangulation_.triangle_slots(), State::unknown);
  for (const tri::TriangleId t : changes_.removed_triangles) states_[tri::slot(t)] = State::unknown;
  drop_settled();
  for (const tri::TriangleId t : changes_.added_triangles) examine(t);
}

void PointWindow::drop_settled() {
  std::erase_if(suspects_, [&](const Suspect& suspect) {
    return states_[tri::slot(suspect.triangle)] != State::suspect;
  });
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
  const double limit = kMaxWidened * std::max(box_.max[0] - box_.min[0], box_.max[1] - box_.min[1]);
  // Slightly more, for rounding.
  const double more = std::min(*at * (1 + 1e-6), limit);
  if (!(more > 0)) return false;
  grow_inner(inner_.widened(more));
  insert_new_points();
  examine_changes();
  for (const Suspect& suspect : suspects_) {
    if (!inner_.covers(suspect.cover.bounds())) continue;
    states_[tri::slot(suspect.triangle)] = State::certain;
  }
  drop_settled();
  return true;
}

bool PointWindow::add_missing() {
  make_trees();
  chosen_.clear();
  for (const Suspect& suspect : suspects_) {
    const bool is_missing = find_missing(suspect);
    if (looks_ >= kLooksAtOnce) {
      takes_too_long_ = cloud_.voids.count_looks(std::exchange(looks_, 0));
    }
    if (takes_too_long_) return false;
    if (!is_missing) states_[tri::slot(suspect.triangle)] = State::certain;
  }
  // Clusters are only read now; their points are found in the next round.
  const bool has_read = read_missing();
  return has_read || !places_.empty();
}

void PointWindow::part(Outer& outer) {
  if (outer.groups.is_built) return;
  const auto at = [&](std::size_t i) { return pending_.begin() + static_cast<std::ptrdiff_t>(i); };
  const auto boundary =
      std::partition(at(outer.begin), at(outer.begin + outer.count),
                     [](const Pending& p) { return p.origin.cluster != kNowhere; });
  outer.groups = groups_.add(
      static_cast<std::uint32_t>(outer.begin),
      static_cast<std::uint32_t>(boundary - pending_.begin()), kPointsPerGroup,
      [&](std::uint32_t i) {
        return StoredBox{pending_[i].place, pending_[i].place};
      },
      [&](std::uint32_t begin, std::uint32_t middle, std::uint32_t end) {
        StoredBox box;
        for (std::uint32_t i = begin; i < end; ++i) {
          box.include(pending_[i].place);
        }
        const std::size_t axis = box.max[0] - box.min[0] >= box.max[1] - box.min[1] ? 0 : 1;
        std::nth_element(at(begin), at(middle), at(end),
                         [axis](const Pending& a, const Pending& b) {
                           return std::pair(a.place[axis], a.origin.index) <
                                  std::pair(b.place[axis], b.origin.index);
                         });
      });
}

void PointWindow::make_trees() {
  if (read_in_trees_ == read_.size()) return;
  read_in_trees_ = read_.size();
  std::vector<BoxTree::Item>& outer = outer_tree_.start();
  for (std::uint32_t k = 0; k < outer_.size(); ++k) {
    if (!inner_.covers(outer_[k].box)) outer.push_back({outer_[k].box, k});
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
  const auto meets_cover = [&](const StoredBox& box) {
    ++looks_;
    return bounds.intersects(box) && cover.meets(box);
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
    groups_.visit(outer.groups, may_hold, look_at_point);
  });
  if (point < pending_.size()) {
    take(pending_[point]);
    return true;
  }
  // Otherwise read clusters of the highest level that may contain some, those with most of the
  // cover.
  const auto open = frontier_.open();
  unsigned level = 0;
  by_depth_.clear();
  open_tree_.visit(meets_cover, [&](std::uint32_t k) {
    if (open[k].level < level) return;
    if (open[k].level > level) by_depth_.clear();
    level = open[k].level;
    by_depth_.emplace_back(cover.depth(open[k].box), k);
  });
  if (by_depth_.empty()) return false;
  const std::size_t count = std::min(clusters_at_once_, by_depth_.size());
  std::nth_element(by_depth_.begin(), by_depth_.begin() + static_cast<std::ptrdiff_t>(count - 1),
                   by_depth_.end());
  for (std::size_t i = 0; i < count; ++i) chosen_.push_back(by_depth_[i].second);
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
