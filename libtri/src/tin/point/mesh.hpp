// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "delaunay2/double_kernel.hpp"
#include "pool.hpp"
#include "samples.hpp"

namespace terrace::tri::tin::points {

using Kernel = planar::DoubleKernel;
using Place2 = std::array<double, 2>;

/// The predicates of Kernel for integers of at most about 2^15 in absolute value.
struct WholeKernel {
  /// Exact, because products are exact.
  static int orientation(const Place2& a, const Place2& b, const Place2& c) {
    const double left = (b[0] - a[0]) * (c[1] - a[1]);
    const double right = (b[1] - a[1]) * (c[0] - a[0]);
    return (left > right ? 1 : 0) - (left < right ? 1 : 0);
  }
  static int in_circle(const Place2& a, const Place2& b, const Place2& c, const Place2& p) {
    const Kernel::Angle at_a = Kernel::angle(a, b, c);
    const Kernel::Angle at_p = Kernel::angle(p, c, b);
    // Sums of two products are exact, and their products below 2^62.
    const double sine = at_a.cross * at_p.dot + at_p.cross * at_a.dot;
    constexpr double kDoubt = 0x1p12;
    if (sine > kDoubt || sine < -kDoubt) return sine < 0 ? 1 : -1;
    const auto whole = [](double x) { return static_cast<std::int64_t>(x); };
    const std::int64_t exact =
        whole(at_a.cross) * whole(at_p.dot) + whole(at_p.cross) * whole(at_a.dot);
    return (exact < 0 ? 1 : 0) - (exact > 0 ? 1 : 0);
  }
};

struct Vertex {
  double x;
  double y;
  double z;
  std::uint32_t sample;  ///< index in Samples::all; kNone: of the frame
};

/// The end of a walk.
struct Spot {
  std::uint32_t triangle = kNone;  ///< contains the place; kNone: outside
  unsigned zeros = 0;              ///< number of its edges whose lines contain the place
  unsigned edge = 0;               ///< one of these
};

struct Mesh {
  Pool<Sample>* samples = nullptr;
  Pool<Vertex> vertices;
  Triangles triangles;        ///< `place`: the sample to insert next
  Pool<std::uint32_t> heads;  ///< heads of the triangles' lists of samples, kNone if empty
  bool whole = false;         ///< true if WholeKernel can handle the vertices

  [[nodiscard]] Place2 place(std::uint32_t v) const { return {vertices[v].x, vertices[v].y}; }
  [[nodiscard]] int orientation(const Place2& a, const Place2& b, const Place2& c) const {
    return whole ? WholeKernel::orientation(a, b, c) : Kernel::orientation(a, b, c);
  }
  [[nodiscard]] int in_circle(const Place2& a, const Place2& b, const Place2& c,
                              const Place2& p) const {
    return whole ? WholeKernel::in_circle(a, b, c, p) : Kernel::in_circle(a, b, c, p);
  }
  /// Walks from a triangle to the one that contains p, exactly. The region is convex, so p is
  /// outside if it is beyond a border edge.
  [[nodiscard]] Spot locate(const Place2& p, std::uint32_t start) const {
    std::uint32_t at = start;
    std::uint32_t from = kNone;
    // The edge that is tried first varies, so that a walk cannot be endless in a mesh that is not
    // Delaunay.
    std::uint32_t random = start * 2654435761u + 1;
    for (;;) {
      const Triangle& t = triangles[at];
      Spot spot{at, 0, 0};
      bool moved = false;
      random = random * 1664525u + 1013904223u;
      unsigned i = (random >> 16) % 3;
      for (unsigned k = 0; k < 3; ++k, i = after(i)) {
        if (t.next[i] == from && from != kNone) continue;
        const int side =
            Kernel::orientation(place(t.corner[after(i)]), place(t.corner[before(i)]), p);
        if (side > 0) continue;
        if (side == 0) {
          ++spot.zeros;
          spot.edge = i;
          continue;
        }
        if (t.next[i] == kNone) return {};
        from = at;
        at = t.next[i];
        moved = true;
        break;
      }
      if (!moved) return spot;
    }
  }
};

/// The plane of a triangle relative to one of its vertices. `sound`: true if doubles can resolve
/// its slope.
struct Plane {
  double gx;
  double gy;
  bool sound;
};
inline Plane plane_of(const Vertex& p, const Vertex& a, const Vertex& b) {
  const double ux = a.x - p.x;
  const double uy = a.y - p.y;
  const double uz = a.z - p.z;
  const double wx = b.x - p.x;
  const double wy = b.y - p.y;
  const double wz = b.z - p.z;
  const double left = ux * wy;
  const double right = uy * wx;
  const double det = left - right;
  const double size = (left < 0 ? -left : left) + (right < 0 ? -right : right);
  return {(uz * wy - wz * uy) / det, (ux * wz - wx * uz) / det, det > 0x1p-36 * size};
}

/// The height of a triangle's surface at a place inside it. It is a convex combination of the
/// vertices' heights whatever the rounding, so slivers do not give outliers.
inline double height_in(const Vertex& a, const Vertex& b, const Vertex& c, double x, double y) {
  const double ax = a.x - x;
  const double ay = a.y - y;
  const double bx = b.x - x;
  const double by = b.y - y;
  const double cx = c.x - x;
  const double cy = c.y - y;
  const auto positive = [](double w) { return w > 0 ? w : 0; };
  const double wa = positive(bx * cy - by * cx);
  const double wb = positive(cx * ay - cy * ax);
  const double wc = positive(ax * by - ay * bx);
  const double sum = wa + wb + wc;
  // If all are zero, the place is a vertex, or the triangle's area is zero in doubles.
  if (!(sum > 0)) {
    const double da = ax * ax + ay * ay;
    const double db = bx * bx + by * by;
    const double dc = cx * cx + cy * cy;
    return da <= db && da <= dc ? a.z : db <= dc ? b.z : c.z;
  }
  // Exact at the vertices, and where heights are equal.
  if (wb == sum) return b.z;
  if (wc == sum) return c.z;
  return a.z + (wb * (b.z - a.z) + wc * (c.z - a.z)) / sum;
}
inline double height_in(const Mesh& mesh, const Triangle& t, double x, double y) {
  return height_in(mesh.vertices[t.corner[0]], mesh.vertices[t.corner[1]],
                   mesh.vertices[t.corner[2]], x, y);
}

}  // namespace terrace::tri::tin::points
