// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include "cavity.hpp"
#include "error_queue.hpp"
#include "ground.hpp"
#include "mesh.hpp"
#include "scan.hpp"
#include "star.hpp"
#include "terrace/tri/grid_tin.hpp"

/// Error-bounded meshes of samples in rows and columns, with vertices at integer coordinates.

namespace terrace::tri::tin {

/// Squares of 32 x 32 samples, small enough for the triangles of one to fit into the first-level
/// cache. Numbered boustrophedon, so that each is next to the previous one.
class Tiles {
 public:
  Tiles(std::int32_t columns, std::int32_t rows)
      : across_((columns >> kBits) + 1), down_((rows >> kBits) + 1) {}

  std::size_t count() const {
    return static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_);
  }
  std::uint32_t of(std::uint32_t place) const {
    const std::int32_t row = row_of(place) >> kBits, column = column_of(place) >> kBits;
    return static_cast<std::uint32_t>(row * across_ +
                                      (row % 2 == 0 ? column : across_ - 1 - column));
  }

 private:
  static constexpr int kBits = 5;
  std::int32_t across_, down_;
};

/// True if a triangle is within the bound at one sample, or does not contain it. Most triangles
/// that cannot replace a vertex fail at that vertex's own sample.
template <class Vertex, class Sample>
bool within_at(const Vertex& a, const Vertex& b, const Vertex& c, const Sample& sample,
               double bound) {
  using Wide = std::conditional_t<std::is_integral_v<decltype(sample.x)>, std::int64_t, double>;
  const auto area = [&](const Vertex& p, const Vertex& q) {
    return Wide{p.x - sample.x} * (q.y - sample.y) - Wide{p.y - sample.y} * (q.x - sample.x);
  };
  const Wide at_a = area(b, c), at_b = area(c, a), at_c = area(a, b);
  if (!(at_a >= 0 && at_b >= 0 && at_c >= 0)) return true;
  const double sum = static_cast<double>(at_a) * static_cast<double>(a.z - sample.z) +
                     static_cast<double>(at_b) * static_cast<double>(b.z - sample.z) +
                     static_cast<double>(at_c) * static_cast<double>(c.z - sample.z);
  return std::fabs(sum) <= bound * static_cast<double>(at_a + at_b + at_c);
}

/// A mesh of an axis-parallel rectangle under construction.
///
/// M. Garland, P. S. Heckbert, "Fast polygonal approximation of terrains and height fields",
/// CMU-CS-95-181. The samples in a triangle are found by their rows and columns, so triangles need
/// no lists of samples, unlike those of point_tin().
///
/// `Samples`, which is RasterSamples or PlacedSamples, evaluates triangles:
/// - Vertex: integer x, y and a height z, NaN without data. Sample: x, y, z of a sample.
/// - kBeside: true if a vertex may differ in position from its sample, so that it may fall on
///   another vertex, on a side of the rectangle or into another triangle. Otherwise a vertex is at
///   its sample, in the triangle that was evaluated, unless it separates data from missing data.
/// - kThinDelaunay: true if removal may leave thin triangles that are Delaunay.
/// - columns(), rows(), ground().
/// - least_error(): smaller errors need not be ordered.
/// - judge(triangle, a, b, c): sets `place` and `error`.
/// - open(place): true if the sample may become a vertex. take(place): returns the vertex of that
///   sample. give_up(place): the sample cannot become a vertex. restore(): undoes all give_up().
/// - place_of(vertex), sample_of(vertex).
/// - within(a, b, c): true if the triangle is within the bound. fits(a, b, c, removed): true if it
///   may help to fill the hole of a removed vertex, given that vertex's sample.
/// - narrow(v, b, c, rises): narrows the range by which v may rise to the range that the samples in
///   the triangle allow. raise(v, rises): moves v to the middle of it; false if it stays.
/// - covers(a, b, c): true if the triangle belongs to the result. publish(vertex, tin).
template <class Samples>
class LatticeSurface {
 public:
  using Vertex = typename Samples::Vertex;

  /// `frame`: vertices on the sides of the rectangle, counter-clockwise, including the four
  /// corners.
  LatticeSurface(Samples samples, std::vector<Vertex> frame)
      : samples_(std::move(samples)),
        tiles_(samples_.columns(), samples_.rows()),
        vertices_(std::move(frame)) {
    Vertex low = vertices_[0], high = vertices_[0];
    for (const Vertex& p : vertices_) {
      low.x = std::min(low.x, p.x), high.x = std::max(high.x, p.x);
      low.y = std::min(low.y, p.y), high.y = std::max(high.y, p.y);
    }
    const auto is_corner = [&](const Vertex& p) {
      return (p.x == low.x || p.x == high.x) && (p.y == low.y || p.y == high.y);
    };
    std::array<std::uint32_t, 4> corner{};
    std::size_t corners = 0;
    for (std::uint32_t v = 0; v < vertices_.size(); ++v)
      if (is_corner(vertices_[v])) corner[corners++] = v;
    triangles_ = {{{corner[0], corner[1], corner[2]}, {kNone, 1, kNone}, 0, 0.0F},
                  {{corner[0], corner[2], corner[3]}, {kNone, kNone, 0}, 0, 0.0F}};
    std::uint32_t near = 0;
    for (std::uint32_t v = 0; v < vertices_.size(); ++v) {
      if (is_corner(vertices_[v])) continue;
      insert(v, locate(vertices_[v], near).triangle);
      near = cavity_.created().front();
    }
  }

  const Samples& samples() const { return samples_; }
  const std::vector<Vertex>& vertices() const { return vertices_; }
  const Triangles& triangles() const { return triangles_; }

  /// Refines to the bound and applies the steps of the quality. `first`: see arrange().
  void make(TinQuality quality, std::size_t first) {
    refine<ErrorBuckets>(std::numeric_limits<std::size_t>::max());
    if (quality == TinQuality::kGreedy) return;
    arrange(first);
    remove();
    if (quality == TinQuality::kRemoval) return;
    fit();
    remove();
  }

  /// Inserts samples until all that can become vertices are within the bound, or until there are
  /// `most` vertices with data. The result is Delaunay. Queue: ErrorBuckets or ErrorHeap.
  template <class Queue>
  void refine(std::size_t most) {
    Queue queue(samples_.least_error());
    const auto judge = [&](std::uint32_t t) {
      Triangle& triangle = triangles_[t];
      samples_.judge(triangle, vertex(triangle, 0), vertex(triangle, 1), vertex(triangle, 2));
      if (triangle.error > 0) queue.push(triangle.error, t);
    };
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) judge(t);
    const auto has_data = [](const Vertex& vertex) { return vertex.z == vertex.z; };
    auto with_data =
        static_cast<std::size_t>(std::count_if(vertices_.begin(), vertices_.end(), has_data));
    while (with_data < most) {
      const std::uint32_t t = queue.pop(triangles_, tiles_.count(), [&](const Triangle& triangle) {
        return tiles_.of(triangle.place);
      });
      if (t == kNone) break;
      const std::uint32_t place = triangles_[t].place;
      // Several triangles may have waited for this sample.
      if (!samples_.open(place)) {
        judge(t);
        continue;
      }
      const Vertex p = samples_.take(place);
      const Spot spot = locate(p, t);
      bool reached = false;
      if (!Samples::kBeside || (spot.triangle != kNone && !spot.taken && !spot.border)) {
        vertices_.push_back(p);
        with_data += has_data(p) ? 1 : 0;
        insert(static_cast<std::uint32_t>(vertices_.size() - 1), spot.triangle);
        for (const std::uint32_t created : cavity_.created()) {
          reached |= created == t;
          judge(created);
        }
      }
      // The triangle still exists, or its sample separated data from missing data and was outside
      // it.
      if (Samples::kBeside ? reached : spot.triangle == t) continue;
      samples_.give_up(place);
      judge(t);
    }
    samples_.restore();
  }

  /// Reorders vertices and triangles so that those close to each other in the plane are close in
  /// memory. The first `first` vertices stay first.
  void arrange(std::size_t first) {
    std::vector<std::uint32_t> keys;
    keys.reserve(triangles_.size());
    const auto tile_of = [&](const Vertex& v) { return tiles_.of(samples_.place_of(v)); };
    for (std::size_t v = 0; v < vertices_.size(); ++v)
      keys.push_back(v < first ? 0 : tile_of(vertices_[v]) + 1);
    const std::vector<std::uint32_t> vertex_at = sorted_by(keys, tiles_.count() + 1);
    keys.clear();
    for (const Triangle& triangle : triangles_) keys.push_back(tile_of(vertex(triangle, 0)));
    const std::vector<std::uint32_t> triangle_at = sorted_by(keys, tiles_.count());
    std::vector<Vertex> vertices(vertices_.size());
    for (std::size_t i = 0; i < vertices.size(); ++i) vertices[vertex_at[i]] = vertices_[i];
    vertices_.swap(vertices);
    Triangles triangles(triangles_.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      Triangle& triangle = triangles[triangle_at[i]] = triangles_[i];
      for (std::uint32_t& corner : triangle.corner) corner = vertex_at[corner];
      for (std::uint32_t& next : triangle.next)
        if (next != kNone) next = triangle_at[next];
    }
    triangles_.swap(triangles);
  }

  /// Removes inner vertices without which the bound still holds, in the order of their numbers.
  void remove() {
    std::vector<std::uint32_t> triangle_of = triangle_of_vertices(triangles_, vertices_.size());
    Star star;
    PolygonFill fill;
    Vertex ring[kMaxRing];
    typename Samples::Sample removed{};
    const auto left = [&](std::size_t i, std::size_t m, std::size_t j) {
      return turn(ring[i], ring[m], ring[j]) > 0;
    };
    const auto inside = [&](std::size_t i, std::size_t m, std::size_t j, std::size_t p) {
      return samples_.ground().in_circle(ring[i], ring[m], ring[j], ring[p]);
    };
    const auto good = [&](std::size_t i, std::size_t m, std::size_t j) {
      const std::int64_t twice = turn(ring[i], ring[m], ring[j]);
      return twice > 0 && samples_.ground().wide(ring[i], ring[m], ring[j], twice) &&
             samples_.fits(ring[i], ring[m], ring[j], removed);
    };
    const auto good_delaunay = [&](std::size_t i, std::size_t m, std::size_t j) {
      if constexpr (!Samples::kThinDelaunay) return good(i, m, j);
      return samples_.fits(ring[i], ring[m], ring[j], removed);
    };
    AnyFill any(good, fill);
    for (std::uint32_t v = 0; v < vertices_.size(); ++v) {
      if (triangle_of[v] == kNone || !star.gather(triangles_, v, triangle_of[v])) continue;
      const std::size_t size = star.size();
      removed = samples_.sample_of(vertices_[v]);
      for (std::size_t i = 0; i < size; ++i) ring[i] = vertices_[star.ring(i)];
      if ((fill_delaunay(size, left, inside, fill) && star.all_of(fill, good_delaunay)) ||
          (size > 3 && any.find(size)))
        star.replace(triangles_, fill, triangle_of, v);
    }
  }

  /// Moves heights of inner vertices to the middle of the range that the samples around them allow.
  void fit() {
    const std::vector<std::uint32_t> triangle_of =
        triangle_of_vertices(triangles_, vertices_.size());
    for (std::uint32_t v = 0; v < vertices_.size(); ++v) {
      if (triangle_of[v] == kNone) continue;
      Vertex& own = vertices_[v];
      Interval rises;
      const bool inner = around(v, triangle_of[v], [&](const Vertex& b, const Vertex& c) {
        samples_.narrow(own, b, c, rises);
        return rises.low <= rises.high;
      });
      const Vertex before = own;
      if (!inner || !samples_.raise(own, rises)) continue;
      // The lattice's height step may be larger than the interval.
      if (Samples::kBeside && !around(v, triangle_of[v], [&](const Vertex& b, const Vertex& c) {
            return samples_.within(own, b, c);
          }))
        own = before;
    }
  }

  /// Adds the triangles that samples cover, and their vertices in the order of their numbers.
  template <class Tin>
  void publish(Tin& tin) const {
    std::vector<std::uint32_t> number(vertices_.size(), kNone);
    tin.triangles.reserve(static_cast<std::size_t>(std::count_if(
        triangles_.begin(), triangles_.end(), [](const Triangle& t) { return t.live(); })));
    for (const Triangle& t : triangles_) {
      if (!t.live() || !samples_.covers(vertex(t, 0), vertex(t, 1), vertex(t, 2))) continue;
      tin.triangles.push_back(t.corner);
      for (const std::uint32_t v : t.corner) number[v] = 0;
    }
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
      if (number[v] == kNone) continue;
      number[v] = static_cast<std::uint32_t>(tin.vertices.size());
      samples_.publish(vertices_[v], tin);
    }
    for (auto& triangle : tin.triangles)
      for (std::uint32_t& v : triangle) v = number[v];
  }

 private:
  struct Spot {
    std::uint32_t triangle;  ///< kNone: outside
    bool taken;              ///< a vertex is already there
    bool border;             ///< on a side of the rectangle
  };

  const Vertex& vertex(const Triangle& triangle, unsigned i) const {
    return vertices_[triangle.corner[i]];
  }

  /// Walks from triangle t to the one that contains p.
  Spot locate(const Vertex& p, std::uint32_t t) const {
    unsigned zeros = 0;
    bool border = false;
    for (unsigned side = 0; side < 3;) {
      const Triangle& triangle = triangles_[t];
      const std::int64_t turned =
          turn(vertex(triangle, after(side)), vertex(triangle, before(side)), p);
      if (turned < 0) {
        t = triangle.next[side];
        if (t == kNone) return {kNone, false, false};
        side = zeros = 0;
        border = false;
        continue;
      }
      if (turned == 0) {
        ++zeros;
        border |= triangle.next[side] == kNone;
      }
      ++side;
    }
    return {t, zeros == 2, border};
  }

  /// Inserts a vertex that is in triangle t. The new triangles are cavity_.created().
  void insert(std::uint32_t number, std::uint32_t t) {
    const Vertex p = vertices_[number];
    cavity_.dig(triangles_, t, [&](const Triangle& triangle) {
      return samples_.ground().in_circle(vertex(triangle, 0), vertex(triangle, 1),
                                         vertex(triangle, 2), p);
    });
    cavity_.fill(triangles_, number, [&](std::uint32_t a, std::uint32_t b) {
      return turn(vertices_[a], vertices_[b], p) == 0;
    });
  }

  /// Calls visit(b, c) for the triangles v, b, c until it returns false. Returns false if it did,
  /// or if v is on a side of the rectangle.
  template <class Visit>
  bool around(std::uint32_t v, std::uint32_t first, const Visit& visit) const {
    std::uint32_t t = first;
    do {
      const Triangle& triangle = triangles_[t];
      const unsigned at = corner_of(triangle, v);
      if (!visit(vertex(triangle, after(at)), vertex(triangle, before(at)))) return false;
      t = triangle.next[after(at)];
    } while (t != first && t != kNone);
    return t == first;
  }

  /// The positions of elements after sorting by key, a number below `count`; equal keys keep their
  /// order.
  static std::vector<std::uint32_t> sorted_by(const std::vector<std::uint32_t>& keys,
                                              std::size_t count) {
    std::vector<std::uint32_t> starts(count + 1, 0);
    for (const std::uint32_t key : keys) ++starts[key + 1];
    for (std::size_t i = 1; i <= count; ++i) starts[i] += starts[i - 1];
    std::vector<std::uint32_t> places;
    places.reserve(keys.size());
    for (const std::uint32_t key : keys) places.push_back(starts[key]++);
    return places;
  }

  Samples samples_;
  Tiles tiles_;
  std::vector<Vertex> vertices_;
  Triangles triangles_;
  Cavity cavity_;
};

}  // namespace terrace::tri::tin
