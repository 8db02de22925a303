// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "mesh.hpp"
#include "scan.hpp"
#include "star.hpp"

/// Meshes with few triangles within an error bound of samples, whatever kind of samples these are.
///
/// M. Garland, P. S. Heckbert, "Fast polygonal approximation of terrains and height fields",
/// CMU-CS-95-181: inserts the sample of greatest error into a Delaunay triangulation until the
/// bound holds. Then vertices without which it still holds are removed.

namespace terrace::tri::tin {

/// The answers that a kind of samples must give. A sample is identified by its `place`, a vertex by
/// its number, and the corners of a triangle are counter-clockwise.
///
/// - Vertex: members x, y and z. Vertices: an array of them.
/// - Hole: the star of a vertex that may be removed, see VertexHole.
/// - FirstSide: the side that a walk tries first, LowestSide or RandomSide.
/// - kMovesVertices: true if a vertex may differ in position from its sample, so that it may fall
///   on another vertex, on the border or into another triangle. Otherwise it is at its sample, in
///   the triangle that was judged, unless it separates data from missing data.
/// - kMaxFittedTriangles: vertices with more triangles keep their height.
template <class S>
concept Samples = requires(S samples, const S const_samples, Mesh<typename S::Vertices> mesh,
                           typename S::Vertex vertex, const Spot spot, std::uint32_t number,
                           std::span<const std::uint32_t> created, Interval rises) {
  requires std::same_as<decltype(S::kMovesVertices), const bool>;
  requires std::same_as<decltype(S::kMaxFittedTriangles), const std::size_t>;
  typename S::Hole;
  { typename S::FirstSide(number).next() } -> std::same_as<unsigned>;

  // Exact predicates. turn(a, b, p): positive if p is left of ab, 0 if it is on the line.
  // in_circle(a, b, c, p): true if p is strictly inside the circle.
  { const_samples.turn(vertex, vertex, vertex) > 0 } -> std::same_as<bool>;
  { const_samples.in_circle(vertex, vertex, vertex, vertex) } -> std::same_as<bool>;
  // True if no vertex may be inserted on the border.
  { const_samples.border_fixed() } -> std::same_as<bool>;

  // set_error(mesh, t): sets `place` and `error` of triangle t to its worst sample that is beyond
  // the bound and may become a vertex. `error` is 0 if there is none. split(mesh, created,
  // place, t, spot): does so for the triangles `created` around the last vertex, which was made
  // from the sample that was the worst of t. The removed triangles' numbers come first.
  samples.set_error(mesh, number);
  samples.split(mesh, created, number, number, spot);
  // open(place): true if the sample may become a vertex. take(place): returns that vertex.
  // give_up(place): it cannot become one after all. restore(): undoes all give_up() that must
  // not outlast refinement. counts(vertex): false if it does not count towards a limit.
  { const_samples.open(number) } -> std::same_as<bool>;
  { samples.take(number) } -> std::same_as<typename S::Vertex>;
  samples.give_up(number);
  samples.restore();
  { const_samples.counts(vertex) } -> std::same_as<bool>;

  // narrow(t, v, b, c, rises): narrows the range by which vertex v of triangle t may rise to
  // the range that the samples in the triangle allow. raise(v, rises): moves v to the middle of
  // it, or false if it stays. within(mesh, t, v, b, c): true if the triangle is within the bound.
  const_samples.narrow(number, vertex, vertex, vertex, rises);
  { const_samples.raise(vertex, rises) } -> std::same_as<bool>;
  { const_samples.within(mesh, number, vertex, vertex, vertex) } -> std::same_as<bool>;

  // True if the triangle belongs to the result. (publish(vertex, tin) adds a vertex to it.)
  { const_samples.covers(vertex, vertex, vertex) } -> std::same_as<bool>;
};

/// The star of a vertex, whose corners are numbered along its ring.
///
/// - gather(mesh, star, v): false if nothing can replace vertex v.
/// - left(i, m, j), inside(i, m, j, p): see fill_delaunay(). fits(i, m, j): true if this Delaunay
///   triangle is within the bound.
/// - fill_otherwise(fill): finds triangles within the bound that need not be Delaunay.
/// - replaced(mesh, star, fill): the fill has replaced the star.
template <class H, class S>
concept VertexHole = requires(H hole, Mesh<typename S::Vertices> mesh, const Star star,
                              PolygonFill fill, std::uint32_t v, std::size_t i) {
  { hole.gather(mesh, star, v) } -> std::same_as<bool>;
  { hole.left(i, i, i) } -> std::same_as<bool>;
  { hole.inside(i, i, i, i) } -> std::same_as<bool>;
  { hole.fits(i, i, i) } -> std::same_as<bool>;
  { hole.fill_otherwise(fill) } -> std::same_as<bool>;
  hole.replaced(mesh, star, fill);
};

/// Limits that end refinement before the bound holds everywhere.
struct RefinementLimits {
  std::size_t vertices =
      std::numeric_limits<std::size_t>::max();  ///< maximum number of vertices that count
  std::size_t triangles = std::numeric_limits<std::size_t>::max();  ///< stops when there are more
};

/// A mesh of a convex region under construction.
template <Samples S>
requires VertexHole<typename S::Hole, S>
class Refinement {
 public:
  using Vertex = typename S::Vertex;

  /// `mesh`: a Delaunay triangulation of the region. Vertices without triangles may be inserted
  /// afterwards. check_stop: called once per vertex, whose triangles may have many samples.
  Refinement(S samples, Mesh<typename S::Vertices> mesh, base::StopCheck check_stop)
      : samples_(std::move(samples)), mesh_(std::move(mesh)), check_stop_(std::move(check_stop)) {}

  void check_stop() const {
    if (check_stop_) check_stop_();
  }
  [[nodiscard]] base::StopTicks ticks() const { return base::StopTicks(check_stop_); }
  S& samples() { return samples_; }
  Mesh<typename S::Vertices>& mesh() { return mesh_; }

  /// From now on a new vertex only splits the triangles that contain it, for meshes that are no
  /// longer Delaunay.
  void stop_delaunay() { delaunay_ = false; }

  /// Walks from triangle `at` to the one that contains p, which has members x and y.
  template <class Place>
  Spot locate(const Place& p, std::uint32_t at) const {
    std::uint32_t from = kNone;
    typename S::FirstSide first(at);
    for (;;) {
      const Triangle& t = mesh_.triangles[at];
      Spot spot{at};
      std::uint32_t next = kNone;
      unsigned side = first.next();
      for (unsigned k = 0; k < 3; ++k, side = next_side(side)) {
        if (from != kNone && t.next[side] == from) continue;
        const auto orientation = samples_.turn(mesh_.vertex(t, next_side(side)),
                                               mesh_.vertex(t, previous_side(side)), p);
        if (orientation > 0) continue;
        if (orientation == 0) {
          ++spot.zeros;
          spot.side = side;
          continue;
        }
        next = t.next[side];
        if (next == kNone) return {};
        break;
      }
      if (next == kNone) {
        spot.border = spot.zeros == 1 && t.next[spot.side] == kNone;
        return spot;
      }
      from = std::exchange(at, next);
    }
  }

  /// Returns the spot of a new vertex. It has no triangle if the vertex cannot be inserted.
  Spot free_spot(const Vertex& p, std::uint32_t near) const {
    const Spot spot = locate(p, near);
    return spot.zeros == 2 || (spot.border && samples_.border_fixed()) ? Spot{} : spot;
  }

  /// Inserts a vertex that is at a spot. Returns the new triangles, which reuse the numbers of the
  /// removed ones first.
  const std::vector<std::uint32_t>& insert(std::uint32_t number, const Spot& spot) {
    const Vertex p = mesh_.vertices[number];
    const std::uint32_t border = mesh_.triangles[spot.triangle].corner[next_side(spot.side)];
    cavity_.grow(mesh_.triangles, spot.triangle, [&](const Triangle& t) {
      const Vertex &a = mesh_.vertex(t, 0), &b = mesh_.vertex(t, 1), &c = mesh_.vertex(t, 2);
      if (delaunay_) return samples_.in_circle(a, b, c, p);
      return samples_.turn(a, b, p) >= 0 && samples_.turn(b, c, p) >= 0 &&
             samples_.turn(c, a, p) >= 0;
    });
    cavity_.fill(mesh_.triangles, number,
                 [&](std::uint32_t a, std::uint32_t) { return spot.border && a == border; });
    return cavity_.created();
  }
  const std::vector<std::uint32_t>& insert(const Vertex& p, const Spot& spot) {
    mesh_.vertices.push_back(p);
    return insert(static_cast<std::uint32_t>(mesh_.vertices.size() - 1), spot);
  }

  /// Judges all triangles and enters them into the queue.
  template <class Queue>
  void judge_all(Queue& queue) {
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      check_stop();
      set_error(queue, t);
    }
  }

  /// Inserts samples until all that can become vertices are within the bound, or a limit is
  /// reached. The queue, from error_queue.hpp, has the triangles with which to start.
  template <class Queue>
  void refine(Queue& queue, const RefinementLimits& limits = {}) {
    std::size_t vertices = 0;
    for (std::uint32_t v = 0; v < mesh_.vertices.size(); ++v)
      vertices += samples_.counts(mesh_.vertices[v]) ? 1 : 0;
    while (vertices < limits.vertices && mesh_.triangles.size() <= limits.triangles) {
      check_stop();
      const std::uint32_t t = queue.pop(mesh_.triangles);
      if (t == kNone) break;
      const std::uint32_t place = mesh_.triangles[t].place;
      // Several triangles may have waited for this sample.
      if (!samples_.open(place)) {
        set_error(queue, t);
        continue;
      }
      const Vertex p = samples_.take(place);
      const Spot spot = free_spot(p, t);
      bool reached = false;
      if (spot.triangle != kNone) {
        const std::vector<std::uint32_t>& created = insert(p, spot);
        vertices += samples_.counts(p) ? 1 : 0;
        samples_.split(mesh_, created, place, t, spot);
        for (const std::uint32_t number : created) {
          reached |= number == t;
          enter(queue, number);
        }
      }
      // The triangle still exists, or its sample separated data from missing data and was outside
      // it.
      if (S::kMovesVertices ? reached : spot.triangle == t) continue;
      samples_.give_up(place);
      set_error(queue, t);
    }
    samples_.restore();
  }

  /// Removes inner vertices without which the bound still holds, in the order of their numbers.
  /// Returns their number. They remain as vertices without triangles. Further passes, until one
  /// removes nothing, try the vertices whose stars have changed since the last attempt.
  std::size_t remove(std::size_t max_passes = 1) {
    std::vector<std::uint32_t> triangle_of =
        triangle_of_vertices(mesh_.triangles, mesh_.vertices.size());
    std::vector<std::uint8_t> untried(mesh_.vertices.size(), 1);
    Star star;
    PolygonFill fill;
    typename S::Hole hole(samples_);
    const auto left = [&](std::size_t i, std::size_t m, std::size_t j) {
      return hole.left(i, m, j);
    };
    const auto inside = [&](std::size_t i, std::size_t m, std::size_t j, std::size_t p) {
      return hole.inside(i, m, j, p);
    };
    const auto fits = [&](std::size_t i, std::size_t m, std::size_t j) {
      return hole.fits(i, m, j);
    };
    std::size_t removed = 0, before = 0;
    do {
      before = removed;
      for (std::uint32_t v = 0; v < mesh_.vertices.size(); ++v) {
        if (untried[v] == 0) continue;
        untried[v] = 0;
        check_stop();
        if (triangle_of[v] == kNone || !star.gather(mesh_.triangles, v, triangle_of[v]) ||
            !hole.gather(mesh_, star, v))
          continue;
        if (!(fill_delaunay(star.size(), left, inside, fill) && star.all_of(fill, fits)) &&
            !hole.fill_otherwise(fill))
          continue;
        star.replace(mesh_.triangles, fill, triangle_of, v);
        hole.replaced(mesh_, star, fill);
        for (std::size_t i = 0; i < star.size(); ++i) untried[star.ring(i)] = 1;
        ++removed;
      }
    } while (removed > before && --max_passes > 0);
    return removed;
  }

  /// Moves heights of inner vertices to the middle of the range that the samples around them allow.
  void fit() {
    const std::vector<std::uint32_t> triangle_of =
        triangle_of_vertices(mesh_.triangles, mesh_.vertices.size());
    for (std::uint32_t v = 0; v < mesh_.vertices.size(); ++v) {
      check_stop();
      if (triangle_of[v] == kNone) continue;
      Vertex& vertex = mesh_.vertices[v];
      Interval rises;
      std::size_t count = 0;
      const bool inner = for_each_triangle_at(
          v, triangle_of[v], [&](std::uint32_t t, const Vertex& b, const Vertex& c) {
            samples_.narrow(t, vertex, b, c, rises);
            return ++count <= S::kMaxFittedTriangles && rises.low <= rises.high;
          });
      const Vertex original = vertex;
      if (!inner || !samples_.raise(vertex, rises)) continue;
      // Steps between heights may be larger than the range.
      if (S::kMovesVertices &&
          !for_each_triangle_at(v, triangle_of[v],
                                [&](std::uint32_t t, const Vertex& b, const Vertex& c) {
                                  return samples_.within(mesh_, t, vertex, b, c);
                                }))
        vertex = original;
    }
  }

  /// Adds the triangles that samples cover, and their vertices in the order of their numbers.
  template <class Tin>
  void publish(Tin& tin) const {
    std::vector<std::uint32_t> number(mesh_.vertices.size(), kNone);
    tin.triangles.reserve(
        static_cast<std::size_t>(std::count_if(mesh_.triangles.begin(), mesh_.triangles.end(),
                                               [](const Triangle& t) { return t.live(); })));
    for (const Triangle& t : mesh_.triangles) {
      if (!t.live() || !samples_.covers(mesh_.vertex(t, 0), mesh_.vertex(t, 1), mesh_.vertex(t, 2)))
        continue;
      tin.triangles.push_back(t.corner);
      for (const std::uint32_t v : t.corner) number[v] = 0;
    }
    tin.vertices.reserve(
        static_cast<std::size_t>(std::count(number.begin(), number.end(), std::uint32_t{0})));
    for (std::uint32_t v = 0; v < mesh_.vertices.size(); ++v) {
      if (number[v] == kNone) continue;
      number[v] = static_cast<std::uint32_t>(tin.vertices.size());
      samples_.publish(mesh_.vertices[v], tin);
    }
    for (auto& triangle : tin.triangles)
      for (std::uint32_t& v : triangle) v = number[v];
  }

 private:
  template <class Queue>
  void enter(Queue& queue, std::uint32_t t) {
    if (mesh_.triangles[t].error > 0) queue.push(mesh_.triangles[t], t);
  }
  template <class Queue>
  void set_error(Queue& queue, std::uint32_t t) {
    samples_.set_error(mesh_, t);
    enter(queue, t);
  }

  /// Calls visit(t, b, c) for the triangles t of vertex v, b, c until it returns false. Returns
  /// false if it did, or if v is on the border.
  template <class Visit>
  bool for_each_triangle_at(std::uint32_t v, std::uint32_t first, const Visit& visit) const {
    std::uint32_t t = first;
    do {
      const Triangle& triangle = mesh_.triangles[t];
      const unsigned at = corner_of(triangle, v);
      if (!visit(t, mesh_.vertex(triangle, next_side(at)),
                 mesh_.vertex(triangle, previous_side(at))))
        return false;
      t = triangle.next[next_side(at)];
    } while (t != first && t != kNone);
    return t == first;
  }

  S samples_;
  Mesh<typename S::Vertices> mesh_;
  base::StopCheck check_stop_;
  Cavity cavity_;
  bool delaunay_ = true;
};

}  // namespace terrace::tri::tin
