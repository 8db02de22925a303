// SPDX-License-Identifier: Apache-2.0
#include "surface/point_surface.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include <terrace/tri/interpolation.hpp>
#include <terrace/tri/predicates.hpp>

#include "surface/point_window.hpp"

namespace terrace::terrain {
namespace {

constexpr double kFarAway = std::numeric_limits<double>::infinity();
/// Bounds the relative error of a squared distance: differences, squares and their sum.
constexpr double kDoubt = 8 * std::numeric_limits<double>::epsilon();
/// The most cells around a place that are searched regardless of the circle.
constexpr std::uint32_t kFarthest = 8;
/// Circles with more cells are searched one by one, as they shrink.
constexpr std::size_t kManyCells = 128;
/// Memory for decoded clusters, for circles that reach beyond the loaded points.
constexpr std::uint64_t kSurfaceCacheBytes = std::uint64_t{4} << 20;
/// The number of corners whose heights are kept. Neighbouring triangles share them, and finding a
/// height takes long between crowded points and beyond the loaded ones.
constexpr std::size_t kCorners = 1024;

double square_of(double dx, double dy) { return dx * dx + dy * dy; }

/// Returns a lower bound of the squared distance to any point in the box.
double least_square(const StoredBox& box, const Point2& place) {
  const auto out = [&](std::size_t k) {
    return std::max({box.min[k] - place[k], place[k] - box.max[k], 0.0});
  };
  // Infinity would mean that the box is skipped.
  return std::min(square_of(out(0), out(1)) * (1 - kDoubt), std::numeric_limits<double>::max());
}

double greatest_square(const StoredBox& box, const Point2& place) {
  const auto out = [&](std::size_t k) {
    return std::max(place[k] - box.min[k], box.max[k] - place[k]);
  };
  return square_of(out(0), out(1)) * (1 + kDoubt);
}

/// Returns the disk around a place that reaches as far as a point, or slightly further.
CircleCover disk(const Point2& place, double square) {
  CircleCover cover;
  cover.has_disk = true;
  cover.near = place;
  constexpr double kVanished = 1e-145;  ///< larger than lengths with a square of zero
  cover.radius = std::sqrt(square) * (1 + kDoubt) + kVanished;
  return cover;
}

/// Returns a box around all covers.
StoredBox bounds_of(std::span<const CircleCover> covers) {
  StoredBox all;
  for (const CircleCover& cover : covers) all.include(cover.bounds());
  return all;
}

}  // namespace

PointSurface::PointSurface(PointCloud& cloud, TooLong too_long, std::uint64_t memory_bytes)
    : cloud_(cloud),
      too_long_(std::move(too_long)),
      memory_bytes_(memory_bytes),
      query_(cloud.store, kSurfaceCacheBytes),
      corners_(kCorners, {{}, NAN}) {
  loaded_.clear();
}

bool PointSurface::load(const StoredBox& box, std::size_t max_points, bool allow_crowding) {
  cells_ = &loaded_;
  return loaded_.load(query_, cloud_.wanted, box, max_points, allow_crowding);
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
  const PointHull::Found found = cloud_.hull.find(place);
  side = found.side;
  switch (side) {
    case PointHull::Side::outside:
      break;
    case PointHull::Side::border:
      return Target{place, cloud_.hull.corners()[found.next]};
    case PointHull::Side::inside:
      return Target{place, cloud_.hull.corners()[0]};
  }
  return std::nullopt;
}

template <class Visit>
void PointSurface::read_in(std::span<const CircleCover> covers, const Point2& from,
                           const Visit& visit) {
  std::uint64_t looks = 0;
  query_.best_first(
      cloud_.wanted.finest(),
      [&](unsigned level, const stream::Box3& whole) {
        ++looks;
        const StoredBox box = flat(whole);
        // A box that is a single place adds nothing, because its head is known.
        if (box.min == box.max || cells_->covers(box)) return kFarAway;
        const auto meets = [&](const CircleCover& cover) { return cover.meets(box); };
        return std::any_of(covers.begin(), covers.end(), meets) && cloud_.wanted(level, whole)
                   ? least_square(box, from)
                   : kFarAway;
      },
      [&](const stream::StoreQuery::Node& node) {
        looks += node.positions.size();
        for (const stream::Point3& p : node.positions) {
          const Point2 place{p[0], p[1]};
          if (!cells_->covers(place)) visit(place);
        }
        return greatest_square(bounds_of(covers), from);
      });
  wants_border_ = cloud_.voids.count_looks(looks);
}

bool PointSurface::knows_border() {
  if (wants_border_ && !cloud_.voids.known()) {
    PointWindow window(cloud_, memory_bytes_);
    cloud_.voids.find(window);
    wants_border_ = false;
  }
  return cloud_.voids.known();
}

void PointSurface::find_triangle(const Target& target) {
  if (triangle_ && has(*triangle_, target)) return;
  triangle_.reset();  // in case reading fails
  // The hull is a fan of triangles around its first corner.
  const std::span<const Point2> hull = cloud_.hull.corners();
  std::size_t before = 1, after = hull.size() - 1;
  while (after - before > 1) {
    const std::size_t middle = before + (after - before) / 2;
    (side_of(hull[0], hull[middle], target) > 0 ? before : after) = middle;
  }
  Corners t{hull[0], hull[before], hull[after]};
  CircleCover cover = CircleCover::of_triangle(t);
  bool changed = false;
  const auto offer = [&](const Point2& p) {
    if (!cover.meets(StoredBox{p, p})) return;
    if (p == t[0] || p == t[1] || p == t[2]) return;
    if (!tri::inside_circle(t[0], t[1], t[2], p)) return;
    // The point and two corners replace the triangle on the target's side.
    std::array<int, 3> side{};
    for (std::size_t i = 0; i < 3; ++i) side[i] = side_of(p, t[i], target);
    for (std::size_t i = 0; i < 3; ++i) {
      if (!(side[(i + 1) % 3] > 0 && side[(i + 2) % 3] < 0)) continue;
      t[i] = p;
      cover = CircleCover::of_triangle(t);
      changed = true;
      break;
    }
  };
  // First uses only points nearby, until the circle is small.
  for (std::uint32_t reach = 1;; reach *= 2) {
    do {
      changed = false;
      cells_->visit_points(cells_->neighbourhood(target.place, reach), offer);
    } while (changed);
    if (reach >= kFarthest || cells_->is_small_or_all(cover.bounds(), reach)) break;
  }
  if (!cells_->covers(cover.bounds()) && knows_border()) {
    const double reach = cloud_.voids.reach({target.place, target.place});
    const CircleCover near = disk(target.place, reach * reach);
    do {
      changed = false;
      cloud_.voids.for_each_around(target.place, offer);
      cells_->visit_cover(near, target.place, offer);
      if (!cells_->covers(near.bounds())) read_in({&near, 1}, target.place, offer);
    } while (changed);
    triangle_ = t;
    return;
  }
  do {
    changed = false;
    cells_->visit_cover(cover, target.place, offer);
    if (!cells_->covers(cover.bounds())) read_in({&cover, 1}, target.place, offer);
  } while (changed);
  triangle_ = t;
}

/// Finds, from the points in memory, the triangle at the first neighbour whose circle was not
/// searched. That circle only shrinks on the side of the triangle. Points on its other side are in
/// the directions of other triangles, whose circles contain them as well.
void PointSurface::narrow_first(const Point2& centre) {
  std::size_t first = 0;
  while (star_.mark(first) != kNone) ++first;
  const Point2 neighbour = star_.neighbour(first);
  Point2 nearer = neighbour, next = star_.next_neighbour(first);
  CircleCover cover = star_.circle(first);
  cells_->visit_cover(cover, centre, [&](const Point2& p) {
    if (!cover.meets(StoredBox{p, p}) || p == centre || p == neighbour || p == next) return;
    const int side = tri::orientation(centre, neighbour, p);
    // On an edge of the hull, no other triangle leads to a point between its ends.
    const bool is_nearer = (centre < p && p < nearer) || (nearer < p && p < centre);
    if (side == 0 && is_nearer) nearer = p;
    if (side <= 0) return;
    if (!tri::inside_circle(centre, neighbour, next, p)) return;
    next = p;
    cover = CircleCover::of_triangle({centre, neighbour, next});
  });
  if (nearer != neighbour) return star_.offer(nearer);
  star_.offer(next);
  for (std::size_t i = 0; i < star_.triangles(); ++i) {
    if (star_.neighbour(i) == neighbour) star_.set_mark(i, kMemory);
  }
}

void PointSurface::find_star(const Point2& centre) {
  star_.start(centre);
  double limit = kFarAway;
  const auto offer = [&](const Point2& p) {
    if (square_of(p[0] - centre[0], p[1] - centre[1]) <= limit) star_.offer(p);
  };
  PointCells::Range visited, range_needed;
  std::size_t cells = 0;
  // Finds the circles that may still contain points in memory.
  const auto find_open = [&] {
    covers_.clear();
    cells = 0;
    for (std::size_t i = 0; i < star_.triangles(); ++i) {
      if (star_.mark(i) != kNone) continue;
      const CircleCover cover = star_.circle(i);
      const PointCells::Range range = cells_->cells_of(cover.bounds());
      if (visited.contains(range)) {
        star_.set_mark(i, kMemory);
      } else {
        covers_.push_back(cover);
        cells += range.count();
      }
    }
    if (covers_.empty()) return;
    range_needed = cells_->cells_of(bounds_of(covers_));
    limit = greatest_square(bounds_of(covers_), centre);
  };
  for (std::uint32_t reach = 1;; reach *= 2) {
    range_needed = cells_->neighbourhood(centre, reach);
    cells_->visit_points(range_needed, visited, offer);
    visited = range_needed;
    if (reach >= kFarthest) break;
    if (!star_.is_closed()) continue;
    find_open();
    if (covers_.empty() || range_needed.count() <= 2 * visited.count()) break;
  }
  if (!star_.is_closed()) {
    for (const Point2& corner : cloud_.hull.corners()) offer(corner);
  }
  while (true) {
    for (find_open(); !covers_.empty(); find_open()) {
      if (cells > kManyCells) {
        narrow_first(centre);
        continue;
      }
      for (std::size_t i = 0; i < star_.triangles(); ++i) {
        if (star_.mark(i) == kNone) star_.set_mark(i, kMemory);
      }
      // The circles of new triangles are inside those of the old ones.
      if (range_needed.count() <= cells) {
        cells_->visit_points(range_needed, visited, offer);
        visited = range_needed;
      } else {
        for (const CircleCover& cover : covers_) cells_->visit_cover(cover, centre, offer);
      }
    }
    for (std::size_t i = 0; i < star_.triangles(); ++i) {
      if (star_.mark(i) == kAll) continue;
      star_.set_mark(i, kAll);
      const CircleCover cover = star_.circle(i);
      if (!cells_->covers(cover.bounds())) covers_.push_back(cover);
    }
    if (covers_.empty()) return;
    if (knows_border()) {
      const double reach = cloud_.voids.reach({centre, centre});
      const CircleCover near = disk(centre, reach * reach);
      limit = kFarAway;
      cloud_.voids.for_each_around(centre, offer);
      cells_->visit_cover(near, centre, offer);
      if (!cells_->covers(near.bounds())) read_in({&near, 1}, centre, offer);
      return;
    }
    limit = greatest_square(bounds_of(covers_), centre);
    read_in(covers_, centre, offer);
  }
}

double PointSurface::height(const Point2& point) {
  const std::hash<double> hash;
  SurfaceCorner& kept = corners_[(31 * hash(point[0]) + hash(point[1])) % corners_.size()];
  if (kept.place == point && !std::isnan(kept.height)) return kept.height;
  kept = {point, cells_->covers(point) ? cells_->height(point) : read_height(point)};
  return kept.height;
}

double PointSurface::read_height(const Point2& point) {
  const stream::Channel& channel = cloud_.store.schema().coordinates[2];
  const StoredBox box{point, point};
  std::optional<double> found;
  query_.descend(
      cloud_.wanted.finest(),
      [&](unsigned at, const stream::StoreQuery::Branch& branch) {
        return !found && box.intersects(flat(branch.box)) && cloud_.wanted(at, branch.box);
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

SurfacePoint PointSurface::at_point(const Point2& point) {
  if (cloud_.hull.is_flat()) return {height(point)};
  find_star(point);
  const SurfaceCorner centre{point, height(point)};
  const auto corner = [&](const Point2& p) { return SurfaceCorner{p, height(p)}; };
  SurfaceCorner before = corner(star_.neighbour(0));
  meeting_.clear();
  for (std::size_t i = 0; i < star_.triangles(); ++i) {
    const SurfaceCorner next = corner(star_.next_neighbour(i));
    meeting_.push_back({centre, before, next});
    before = next;
  }
  return where_triangles_meet(point, centre.height, meeting_, too_long_);
}

void PointSurface::find_on_line(const Point2& place) {
  points_.clear();
  // Along the line, points are in lexicographic order.
  Point2 before = cloud_.hull.corners().front(), after = cloud_.hull.corners().back();
  if (place < before || after < place || tri::orientation(before, after, place) != 0) return;
  const auto cover_now = [&] {
    const auto square_to = [&](const Point2& p) {
      return square_of(p[0] - place[0], p[1] - place[1]);
    };
    return disk(place, std::max(square_to(before), square_to(after)));
  };
  CircleCover cover = cover_now();
  const auto offer = [&](const Point2& p) {
    if (before < p && p <= place) before = p;
    if (place <= p && p < after) after = p;
    cover = cover_now();
  };
  cells_->visit_cover(cover, place, offer);
  if (!cells_->covers(cover.bounds())) read_in({&cover, 1}, place, offer);
  points_.push_back(before);
  if (after != before) points_.push_back(after);
}

SurfacePoint PointSurface::linear(const Point2& place) {
  if (cloud_.hull.is_flat()) {
    find_on_line(place);
    if (points_.size() == 1) return {height(place)};
    if (points_.empty() || (too_long_ && too_long_(points_[0], points_[1]))) return {};
    return {on_edge({points_[0], height(points_[0])}, {points_[1], height(points_[1])}, place)};
  }
  PointHull::Side where{};
  const std::optional<Target> target = target_of(place, where);
  if (!target) return {};
  find_triangle(*target);
  const Corners t = *triangle_;
  if (std::find(t.begin(), t.end(), place) != t.end()) return at_point(place);
  const SurfaceTriangle triangle = with_heights(t);
  for (std::size_t i = 0; i < 3; ++i) {
    const SurfaceCorner &a = triangle[i], &b = triangle[(i + 1) % 3];
    if (tri::orientation(a.place, b.place, place) != 0) continue;
    if (too_long_ && too_long_(a.place, b.place)) return {};
    meeting_.assign(1, triangle);
    // The triangle on the other side, unless the edge is on the hull.
    for (const Point2& beyond : cloud_.hull.corners()) {
      if (tri::orientation(a.place, b.place, beyond) >= 0) continue;
      find_triangle({place, beyond});
      meeting_.push_back(with_heights(*triangle_));
      break;
    }
    return where_triangles_meet(place, on_edge(a, b, place), meeting_, too_long_);
  }
  return is_surface(triangle, too_long_) ? on_plane(triangle, place) : SurfacePoint{};
}

SurfacePoint PointSurface::natural_among(std::vector<Point2>& points, const Point2& place) {
  // A canonical order, so that the last bits are the same.
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  tri::Delaunay2<double> few;
  const std::vector<tri::VertexId> vertices = few.build(points);
  std::vector<double> heights(few.vertex_slots());
  for (std::size_t i = 0; i < points.size(); ++i) {
    heights[tri::slot(vertices[i])] = height(points[i]);
  }
  const std::span<const Point2> one(&place, 1);
  const double at = tri::heights_at(few, heights, one, tri::Interpolation::natural_neighbour, 1)[0];
  const tri::Gradient gradient =
      tri::gradients_at(few, heights, one, tri::GradientFrom::natural_neighbours, 1)[0];
  return {at, gradient.x, gradient.y};
}

SurfacePoint PointSurface::natural(const Point2& place) {
  if (cloud_.hull.is_flat()) {
    if (std::isnan(linear(place).height)) return {};
    return natural_among(points_, place);
  }
  PointHull::Side where{};
  const std::optional<Target> target = target_of(place, where);
  if (!target || (too_long_ && std::isnan(linear(place).height))) return {};
  points_.clear();
  if (where == PointHull::Side::border) {
    find_triangle(*target);
    const Corners& t = *triangle_;
    points_.assign(t.begin(), t.end());
  }
  // The neighbours that the place has, or would have if it were a point.
  if (where == PointHull::Side::inside || std::count(points_.begin(), points_.end(), place) > 0) {
    find_star(place);
    points_.clear();
    if (star_.has_centre()) points_.push_back(place);
    for (std::size_t i = 0; i < star_.size(); ++i) points_.push_back(star_.neighbour(i));
  }
  return natural_among(points_, place);
}

Point2 PointSurface::nearest(const Point2& place) {
  Point2 best{};
  bool found = false;
  double bound = kFarAway;  ///< the squared distance to best or slightly more; may overflow
  const auto offer = [&](const Point2& p) {
    const double square = square_of(p[0] - place[0], p[1] - place[1]);
    if (square > bound) return;
    if (found) {
      // Doubles distinguish most points.
      const bool is_nearer = square * (1 + kDoubt) * (1 + kDoubt) < bound;
      if (!is_nearer) {
        const int order = tri::compare_distance(place, p, best);
        if (order > 0 || (order == 0 && !(p < best))) return;
      }
    }
    best = p;
    found = true;
    bound = square * (1 + kDoubt);
  };
  for (std::uint32_t reach = 1;; reach *= 2) {
    cells_->visit_points(cells_->neighbourhood(place, reach), offer);
    if (found && cells_->is_small_or_all(disk(place, bound).bounds(), reach)) break;
    if (found || reach < kFarthest) continue;
    for (const Point2& corner : cloud_.hull.corners()) offer(corner);
  }
  const CircleCover cover = disk(place, bound);
  cells_->visit_cover(cover, place, offer);
  if (!cells_->covers(cover.bounds())) read_in({&cover, 1}, place, offer);
  return best;
}

}  // namespace terrace::terrain
