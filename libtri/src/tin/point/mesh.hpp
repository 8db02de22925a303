// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "delaunay2/double_kernel.hpp"
#include "pool.hpp"
#include "tin/mesh.hpp"

namespace terrace::tri::tin::points {

using Kernel = planar::DoubleKernel;
using Place2 = std::array<double, 2>;

/// The predicates of Kernel for integers from 0 to 2^15. Larger or negative ones would overflow.
struct SmallIntegerKernel {
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
    const auto to_integer = [](double x) { return static_cast<std::int64_t>(x); };
    const std::int64_t exact = to_integer(at_a.cross) * to_integer(at_p.dot) +
                               to_integer(at_p.cross) * to_integer(at_a.dot);
    return (exact < 0 ? 1 : 0) - (exact > 0 ? 1 : 0);
  }
};

struct Vertex {
  double x;
  double y;
  double z;
  std::uint32_t sample;  ///< its index, or kNone for a vertex of the frame
};

// Values of Sample::next for samples that are in no list.
inline constexpr std::uint32_t kOutside = 0xFFFFFFFEu;   ///< outside the mesh
inline constexpr std::uint32_t kIsVertex = 0xFFFFFFFDu;  ///< at a vertex of the mesh
inline constexpr std::uint32_t kUnlisted = 0xFFFFFFFCu;  ///< not located yet

/// A sample as a member of its triangle's list. It takes half a cache line, so following the list
/// also loads the values to measure.
struct Sample {
  double x;
  double y;
  double z;
  std::uint32_t next;  ///< next in the list, kNone at its end, or one of the values above
  /// The caller's number, with kStuck set if it cannot become a vertex.
  std::uint32_t id;
};
inline constexpr std::uint32_t kStuck = 0x80000000u;
inline bool stuck(const Sample& sample) { return (sample.id & kStuck) != 0; }
inline std::uint32_t number(const Sample& sample) { return sample.id & ~kStuck; }

using PointMesh = Mesh<Pool<Vertex>>;

/// The position of a vertex or sample.
template <class At>
Place2 place(const At& at) {
  return {at.x, at.y};
}

/// The gradient of a triangle's plane: height per unit of x and of y. `reliable`: false if the
/// triangle is too thin for doubles to resolve it.
struct Plane {
  double gx;
  double gy;
  bool reliable;
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
  // If all are zero, the triangle's area is zero in doubles: takes the nearest vertex.
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
inline double height_in(const PointMesh& mesh, const Triangle& t, double x, double y) {
  return height_in(mesh.vertex(t, 0), mesh.vertex(t, 1), mesh.vertex(t, 2), x, y);
}

}  // namespace terrace::tri::tin::points
