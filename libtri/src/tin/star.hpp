// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "mesh.hpp"

/// The triangles around a vertex, and the triangles that may replace them.

namespace terrace::tri::tin {

/// Larger stars are left alone, as filling one takes cubic time.
inline constexpr std::size_t kMaxRing = 16;

/// How a polygon is cut into triangles. The triangle on the chord from i to j (i < j, with the
/// polygon's part i..j on its other side) has its third corner at apex[i][j]. The chord of the
/// whole polygon is the last side, from 0 to size - 1.
struct PolygonFill {
  std::array<std::array<std::uint8_t, kMaxRing>, kMaxRing> apex;
};

/// Among the ways to cut a counter-clockwise polygon of `size` corners into triangles, finds the
/// one whose worst triangle costs least. `worst(i, m, j, limit)`, for corners i < m < j, is the
/// cost of a triangle. It may be any number above `limit` if the triangle costs more than that, is
/// not counter-clockwise or is not wanted. Returns false if each way costs more than `limit`.
/// Dynamic programming, at most O(size^3) calls: G. T. Klincsek, "Minimal triangulations of
/// polygonal domains", 1980.
///
/// Triangles that are all counter-clockwise do not overlap, because the polygon winds around each
/// point only once.
template <class Cost, class Worst>
bool fill_least_worst(std::size_t size, Cost limit, const Worst& worst, PolygonFill& fill) {
  constexpr Cost kNever = std::numeric_limits<Cost>::infinity();
  std::array<std::array<Cost, kMaxRing>, kMaxRing> cost;
  for (std::size_t i = 0; i + 1 < size; ++i) cost[i][i + 1] = 0;
  for (std::size_t length = 2; length < size; ++length) {
    for (std::size_t i = 0; i + length < size; ++i) {
      const std::size_t j = i + length;
      Cost best = kNever;
      for (std::size_t m = i + 1; m < j; ++m) {
        const Cost parts = cost[i][m] > cost[m][j] ? cost[i][m] : cost[m][j];
        if (parts > limit || parts >= best) continue;
        const Cost allowed = best < limit ? best : limit;
        const Cost triangle_cost = worst(i, m, j, allowed);
        if (triangle_cost > allowed) continue;
        const Cost all = triangle_cost > parts ? triangle_cost : parts;
        if (all >= best) continue;
        best = all;
        fill.apex[i][j] = static_cast<std::uint8_t>(m);
      }
      cost[i][j] = best;
    }
  }
  return cost[0][size - 1] <= limit;
}

/// Finds any way to cut such a polygon into triangles for which fits(i, m, j) holds. Only
/// counter-clockwise triangles may fit. Slightly more triangles remain in the end than with
/// fill_least_worst(), but there are far fewer calls, as only parts next to a fitting triangle are
/// examined.
template <class Fits>
class AnyFill {
 public:
  AnyFill(const Fits& fits, PolygonFill& fill) : fits_(fits), fill_(fill) {}

  /// Fills a polygon of `size` corners. Returns false if it is impossible.
  bool find(std::size_t size) {
    found_.fill(0);
    failed_.fill(0);
    return part(0, size - 1);
  }

 private:
  bool part(std::size_t i, std::size_t j) {
    if (j - i == 1 || has(found_, i, j)) return true;
    for (std::size_t m = i + 1; m < j; ++m) {
      if (has(failed_, i, m) || has(failed_, m, j) || !fits_(i, m, j) || !part(i, m) || !part(m, j))
        continue;
      fill_.apex[i][j] = static_cast<std::uint8_t>(m);
      found_[i] |= 1U << j;
      return true;
    }
    failed_[i] |= 1U << j;
    return false;
  }

  /// A bit for each j of each i.
  using Parts = std::array<std::uint32_t, kMaxRing>;
  static bool has(const Parts& parts, std::size_t i, std::size_t j) {
    return (parts[i] >> j & 1U) != 0;
  }

  const Fits& fits_;
  PolygonFill& fill_;
  Parts found_, failed_;
};

/// Finds the Delaunay triangles of a polygon that is the star of a vertex of a Delaunay
/// triangulation. `left(i, m, j)`: true if the corners turn left. `inside(i, m, j, p)`: true if
/// corner p is strictly inside the circle of those three. In other triangulations it may fail
/// (false) or find triangles that are not Delaunay. O(size^2).
template <class Left, class Inside>
bool fill_delaunay(std::size_t size, const Left& left, const Inside& inside, PolygonFill& fill) {
  std::array<std::array<std::uint8_t, 2>, kMaxRing> stack;
  std::size_t depth = 0;
  stack[depth++] = {0, static_cast<std::uint8_t>(size - 1)};
  while (depth > 0) {
    const auto [i, j] = stack[--depth];
    std::size_t best = kMaxRing;
    for (std::size_t m = i + 1U; m < j; ++m)
      if (left(i, m, j) && (best == kMaxRing || inside(i, best, j, m))) best = m;
    if (best == kMaxRing) return false;
    const auto apex = static_cast<std::uint8_t>(best);
    fill.apex[i][j] = apex;
    if (apex - i > 1) stack[depth++] = {i, apex};
    if (j - apex > 1) stack[depth++] = {apex, j};
  }
  return true;
}

/// A vertex's triangles in counter-clockwise order.
class Star {
 public:
  /// Returns false if the vertex is on the hull or has more than kMaxRing neighbours.
  bool gather(const Triangles& triangles, std::uint32_t vertex, std::uint32_t first) {
    size_ = 0;
    std::uint32_t t = first;
    do {
      if (size_ == kMaxRing) return false;
      const Triangle& triangle = triangles[t];
      const unsigned at = corner_of(triangle, vertex);
      ring_[size_] = triangle.corner[next_side(at)];
      outer_[size_] = triangle.next[at];
      slot_[size_++] = t;
      t = triangle.next[next_side(at)];
      if (t == kNone) return false;
    } while (t != first);
    return true;
  }

  std::size_t size() const { return size_; }
  std::uint32_t ring(std::size_t i) const { return ring_[i]; }
  /// the triangle with ring(i) and ring(i + 1)
  std::uint32_t triangle(std::size_t i) const { return slot_[i]; }

  /// Calls visit(i, m, j) for each triangle of a fill.
  template <class Visit>
  bool all_of(const PolygonFill& fill, const Visit& visit) const {
    return all_of(fill, 0, size_ - 1, visit);
  }

  /// Replaces the vertex's triangles by those of a fill. Two slots are empty afterwards.
  /// `triangle_of` has a triangle for each vertex and is kept up to date.
  void replace(Triangles& triangles, const PolygonFill& fill,
               std::vector<std::uint32_t>& triangle_of, std::uint32_t vertex) {
    used_ = 0;
    for (std::size_t i = 0; i < size_; ++i)
      if (outer_[i] != kNone)
        back_[i] = static_cast<std::uint8_t>(side_to(triangles[outer_[i]], slot_[i]));
    const std::uint32_t last = put(triangles, fill, triangle_of, 0, size_ - 1);
    link(triangles, last, 1, size_ - 1);
    for (; used_ < size_; ++used_) triangles[slot_[used_]].corner[0] = kNone;
    triangle_of[vertex] = kNone;
  }

 private:
  template <class Visit>
  bool all_of(const PolygonFill& fill, std::size_t i, std::size_t j, const Visit& visit) const {
    if (j - i < 2) return true;
    const std::size_t m = fill.apex[i][j];
    return visit(i, m, j) && all_of(fill, i, m, visit) && all_of(fill, m, j, visit);
  }

  /// Links side `side` of triangle t to side i of the ring.
  void link(Triangles& triangles, std::uint32_t t, unsigned side, std::size_t i) {
    triangles[t].next[side] = outer_[i];
    if (outer_[i] != kNone) triangles[outer_[i]].next[back_[i]] = t;
  }

  /// Corners are (ring i, ring apex, ring j), so side 1 is the chord.
  std::uint32_t put(Triangles& triangles, const PolygonFill& fill,
                    std::vector<std::uint32_t>& triangle_of, std::size_t i, std::size_t j) {
    const std::size_t m = fill.apex[i][j];
    const std::uint32_t t = slot_[used_++];
    triangles[t] = {{ring_[i], ring_[m], ring_[j]}, {kNone, kNone, kNone}, 0, 0.0F};
    for (const std::uint32_t vertex : triangles[t].corner) triangle_of[vertex] = t;
    attach(triangles, fill, triangle_of, t, 2, i, m);
    attach(triangles, fill, triangle_of, t, 0, m, j);
    return t;
  }

  void attach(Triangles& triangles, const PolygonFill& fill,
              std::vector<std::uint32_t>& triangle_of, std::uint32_t t, unsigned side,
              std::size_t i, std::size_t j) {
    if (j - i == 1) return link(triangles, t, side, i);
    const std::uint32_t part = put(triangles, fill, triangle_of, i, j);
    triangles[t].next[side] = part;
    triangles[part].next[1] = t;
  }

  std::size_t size_ = 0;
  std::size_t used_ = 0;
  std::array<std::uint32_t, kMaxRing> ring_;
  std::array<std::uint32_t, kMaxRing> outer_;  ///< across the side from ring i to ring i + 1
  std::array<std::uint8_t, kMaxRing> back_;    ///< the side of that triangle towards the star
  std::array<std::uint32_t, kMaxRing> slot_;
};

}  // namespace terrace::tri::tin
