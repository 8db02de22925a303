// SPDX-License-Identifier: Apache-2.0
#include "surface/point_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <terrace/tri/interpolation.hpp>
#include <terrace/tri/predicates.hpp>

namespace terrace::terrain {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
/// More than a square of a distance is wrong by: differences, squares and their sum.
constexpr double kDoubt = 8 * std::numeric_limits<double>::epsilon();
/// Cells around that are looked at without regard to the circle, at most.
constexpr std::uint32_t kFarthest = 8;
/// Decoded clusters to keep, for circles that reach beyond what is loaded.
constexpr std::uint64_t kCacheBytes = std::uint64_t{4} << 20;

CircleCover circle_of(const std::array<Point2, 3>& t) {
  return CircleCover::of_triangle(t[0], t[1], t[2]);
}

double square_of(double dx, double dy) { return dx * dx + dy * dy; }

/// Not above the square of the distance of any point in the box.
double least_square(const StoredBox& box, const Point2& place) {
  const auto out = [&](std::size_t k) {
    return std::max({box.min[k] - place[k], place[k] - box.max[k], 0.0});
  };
  // Infinite would mean that the box is not to be looked into.
  return std::min(square_of(out(0), out(1)) * (1 - kDoubt), std::numeric_limits<double>::max());
}

double greatest_square(const StoredBox& box, const Point2& place) {
  const auto out = [&](std::size_t k) {
    return std::max(place[k] - box.min[k], box.max[k] - place[k]);
  };
  return square_of(out(0), out(1)) * (1 + kDoubt);
}

/// The disk around a place as far as a point, or a little more.
CircleCover disk(const Point2& place, double square) {
  CircleCover cover;
  cover.has_disk = true;
  cover.near = place;
  constexpr double kVanished = 1e-145;  ///< more than lengths whose squares are zero
  cover.radius = std::sqrt(square) * (1 + kDoubt) + kVanished;
  return cover;
}

}  // namespace

PointSurface::PointSurface(const stream::Store& store, unsigned level, const PointHull& hull,
                           TooLong too_long)
    : store_(store),
      level_(level),
      hull_(hull),
      too_long_(std::move(too_long)),
      query_(store, kCacheBytes) {
  own_.clear();
}

bool PointSurface::load(const StoredBox& box, std::size_t most_points, bool may_crowd) {
  cells_ = &own_;
  return own_.load(query_, level_, box, most_points, may_crowd);
}

int PointSurface::side_of(const Point2& a, const Point2& b, const Target& target) {
  int side = tri::orientation(a, b, target.place);
  if (side != 0) return side;
  side = tri::orientation(a, b, target.towards);
  if (side != 0) return side;
  return (a < b) == (target.place < target.towards) ? 1 : -1;
}

bool PointSurface::has(const Corners& t, const Target& target) {
  return side_of(t[0], t[1], target) > 0 && side_of(t[1], t[2], target) > 0 &&
         side_of(t[2], t[0], target) > 0;
}

std::optional<PointSurface::Target> PointSurface::target_of(const Point2& place,
                                                            PointHull::Side& side) const {
  const PointHull::Found found = hull_.find(place);
  side = found.side;
  switch (side) {
    case PointHull::Side::kOutside:
      break;
    case PointHull::Side::kBorder:
      return Target{place, hull_.corners()[found.next]};
    case PointHull::Side::kInside:
      return Target{place, hull_.corners()[0]};
  }
  return std::nullopt;
}

template <class Visit>
void PointSurface::for_each_in(const CircleCover& cover, const Point2& from, const Visit& visit) {
  cells_->in(cover, visit);
  if (cells_->knows(cover.bounds())) return;
  query_.best_first(
      level_,
      [&](const stream::Box3& whole) {
        const StoredBox box = flat(whole);
        // Of a box that is one place the head is known, and so is its place.
        if (box.min == box.max || cells_->knows(box) || !cover.meets(box)) return kFar;
        return least_square(box, from);
      },
      [&](const stream::StoreQuery::Node& node) {
        for (const stream::Point3& p : node.positions) {
          const Point2 place{p[0], p[1]};
          if (!cells_->knows(place)) visit(place);
        }
        return greatest_square(cover.bounds(), from);
      });
}

void PointSurface::find_triangle(const Target& target) {
  if (triangle_ && has(*triangle_, target)) return;
  triangle_.reset();  // in case reading fails
  // The hull is a fan of triangles round its first corner.
  const std::span<const Point2> hull = hull_.corners();
  std::size_t before = 1, after = hull.size() - 1;
  while (after - before > 1) {
    const std::size_t middle = before + (after - before) / 2;
    (side_of(hull[0], hull[middle], target) > 0 ? before : after) = middle;
  }
  Corners t{hull[0], hull[before], hull[after]};
  CircleCover cover = circle_of(t);
  bool changed = false;
  const auto offer = [&](const Point2& p) {
    if (!cover.meets(StoredBox{p, p})) return;
    if (p == t[0] || p == t[1] || p == t[2]) return;
    if (!tri::inside_circle(t[0], t[1], t[2], p)) return;
    // The point and the corners part the triangle, or it and what lies between it and the point.
    std::array<int, 3> side{};
    for (std::size_t i = 0; i < 3; ++i) side[i] = side_of(p, t[i], target);
    for (std::size_t i = 0; i < 3; ++i) {
      if (!(side[(i + 1) % 3] > 0 && side[(i + 2) % 3] < 0)) continue;
      t[i] = p;
      cover = circle_of(t);
      changed = true;
      break;
    }
  };
  // First as if there were no points but those around, until they leave a small circle.
  for (std::uint32_t reach = 1;; reach *= 2) {
    do {
      changed = false;
      cells_->near(target.place, reach, offer);
    } while (changed);
    if (reach >= kFarthest || cells_->is_near(cover.bounds(), reach)) break;
  }
  do {
    changed = false;
    for_each_in(cover, target.place, offer);
  } while (changed);
  triangle_ = t;
}

std::optional<Point2> PointSurface::apex(const Point2& a, const Point2& b) {
  std::optional<Point2> best;
  CircleCover cover;
  const auto offer = [&](const Point2& p) {
    if (best && !cover.meets(StoredBox{p, p})) return;
    if (!(tri::orientation(a, b, p) > 0) || (best && !tri::inside_circle(a, b, *best, p))) return;
    best = p;
    cover = CircleCover::of_triangle(a, b, p);
  };
  for (std::uint32_t reach = 1;; reach *= 2) {
    cells_->near(b, reach, offer);
    if (best && (reach >= kFarthest || cells_->is_near(cover.bounds(), reach))) break;
    if (best || reach < kFarthest) continue;
    for (const Point2& corner : hull_.corners()) offer(corner);
    if (!best) return std::nullopt;
  }
  // What is left of the edge in the circle only becomes less.
  for_each_in(cover, b, offer);
  return best;
}

void PointSurface::find_star(const Point2& point) {
  star_.clear();
  Corners t = *triangle_;
  while (t[0] != point) std::rotate(t.begin(), t.begin() + 1, t.end());
  star_.push_back(t);
  const Point2 first = t[1];
  std::optional<Point2> next = t[2];
  for (Point2 last = t[2]; last != first; last = *next) {
    next = apex(point, last);
    if (!next) break;
    star_.push_back({point, last, *next});
  }
  if (next) return;
  // Met the hull: the other way for the rest.
  for (Point2 last = first; (next = apex(last, point)); last = *next) {
    star_.push_back({point, *next, last});
  }
}

double PointSurface::height(const Point2& point) {
  if (cells_->knows(point)) return cells_->height(point);
  const stream::Channel& channel = store_.schema().coordinates[2];
  const StoredBox box{point, point};
  std::optional<double> found;
  query_.descend(
      level_,
      [&](unsigned, const stream::StoreQuery::Branch& branch) {
        return !found && box.meets(branch.box);
      },
      [&](const stream::StoreQuery::Node& node) {
        for (const stream::Point3& p : node.positions) {
          if (found || p[0] != point[0] || p[1] != point[1]) continue;
          found = p[2] * channel.scale + channel.offset;
        }
      });
  return found.value_or(NAN);
}

SurfaceTriangle PointSurface::with_heights(const Corners& corners) {
  SurfaceTriangle triangle;
  for (std::size_t i = 0; i < 3; ++i) triangle[i] = {corners[i], height(corners[i])};
  return triangle;
}

SurfacePoint PointSurface::linear(const Point2& place) {
  PointHull::Side where{};
  const std::optional<Target> target = target_of(place, where);
  if (!target) return {};
  find_triangle(*target);
  const Corners& t = *triangle_;
  for (const Point2& corner : t) {
    if (corner != place) continue;
    find_star(corner);
    meeting_.clear();
    for (const Corners& one : star_) meeting_.push_back(with_heights(one));
    return where_triangles_meet(corner, meeting_[0][0].height, meeting_, too_long_);
  }
  const SurfaceTriangle triangle = with_heights(t);
  for (std::size_t i = 0; i < 3; ++i) {
    const SurfaceCorner &a = triangle[i], &b = triangle[(i + 1) % 3];
    if (tri::orientation(a.place, b.place, place) != 0) continue;
    if (too_long_ && too_long_(a.place, b.place)) return {};
    meeting_.assign(1, triangle);
    if (const auto beyond = apex(b.place, a.place)) {
      meeting_.push_back({b, a, {*beyond, height(*beyond)}});
    }
    return where_triangles_meet(place, on_edge(a, b, place), meeting_, too_long_);
  }
  return is_surface(triangle, too_long_) ? on_plane(triangle, place) : SurfacePoint{};
}

SurfacePoint PointSurface::natural_among(std::vector<Point2>& points, const Point2& place) {
  // In an order of their own, for the last bits.
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  tri::Delaunay2<double> few;
  const std::vector<tri::VertexId> vertices = few.build(points);
  std::vector<double> heights(few.vertex_slots());
  for (std::size_t i = 0; i < points.size(); ++i) {
    heights[tri::slot(vertices[i])] = height(points[i]);
  }
  const std::span<const Point2> one(&place, 1);
  const double at = tri::heights_at(few, heights, one, tri::Interpolation::kNaturalNeighbour, 1)[0];
  const tri::Gradient gradient =
      tri::gradients_at(few, heights, one, tri::GradientFrom::kNaturalNeighbours, 1)[0];
  return {at, gradient.x, gradient.y};
}

SurfacePoint PointSurface::natural(const Point2& place) {
  PointHull::Side where{};
  const std::optional<Target> target = target_of(place, where);
  if (!target || (too_long_ && std::isnan(linear(place).height))) return {};
  find_triangle(*target);
  points_.clear();
  const Corners t = *triangle_;
  if (std::find(t.begin(), t.end(), place) != t.end()) {
    find_star(place);
    for (const Corners& one : star_) points_.insert(points_.end(), one.begin(), one.end());
  } else if (where == PointHull::Side::kBorder) {
    points_.assign(t.begin(), t.end());
  } else {
    // The neighbours that the place would have: the corners of all triangles that it would remove.
    const Point2 first = nearest(place);
    Point2 last = first;
    do {
      points_.push_back(last);
      last = apex(place, last).value_or(first);  // inside the hull there is always one
    } while (last != first);
  }
  return natural_among(points_, place);
}

Point2 PointSurface::nearest(const Point2& place) {
  Point2 best{};
  double bound = kFar;  ///< the square of its distance, or a little more
  const auto offer = [&](const Point2& p) {
    const double square = square_of(p[0] - place[0], p[1] - place[1]);
    if (square > bound) return;
    if (bound < kFar) {
      // Doubles tell most of them apart.
      const bool is_nearer = square * (1 + kDoubt) * (1 + kDoubt) < bound;
      if (!is_nearer) {
        const int order = tri::compare_distance(place, p, best);
        if (order > 0 || (order == 0 && !(p < best))) return;
      }
    }
    best = p;
    bound = square * (1 + kDoubt);
  };
  for (std::uint32_t reach = 1;; reach *= 2) {
    cells_->near(place, reach, offer);
    if (bound < kFar && cells_->is_near(disk(place, bound).bounds(), reach)) break;
    if (bound < kFar || reach < kFarthest) continue;
    for (const Point2& corner : hull_.corners()) offer(corner);
  }
  for_each_in(disk(place, bound), place, offer);
  return best;
}

}  // namespace terrace::terrain
