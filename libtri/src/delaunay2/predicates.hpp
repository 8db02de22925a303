// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mesh.hpp"

/// The kernel's predicates, made strict by symbolic perturbation and extended to ghost triangles.

namespace terrace::tri::planar {

/// inside_circle() for four cocircular points. Not inlined, as it is rarely called.
template <class Kernel>
[[gnu::noinline]] bool inside_perturbed_circle(typename Kernel::Point a, typename Kernel::Point b,
                                               typename Kernel::Point c, typename Kernel::Point p) {
  if (lexicographically_less(a, b)) {
    if (lexicographically_less(b, c))
      return lexicographically_less(p, c) && Kernel::orientation(a, b, p) > 0;
    return lexicographically_less(p, b) && Kernel::orientation(c, a, p) > 0;
  }
  if (lexicographically_less(a, c))
    return lexicographically_less(p, c) && Kernel::orientation(a, b, p) > 0;
  return lexicographically_less(p, a) && Kernel::orientation(b, c, p) > 0;
}

/// True if p, different from a, b and c, is inside the circle through the counter-clockwise a, b, c
/// after the perturbation: every lifted point is raised infinitesimally, the lexicographically
/// larger infinitely more. Of four cocircular points only the largest counts. If it is p, p is
/// outside. If it is another one, the lifted plane tilts about the other two, and p is below it on
/// the side of the raised one. No three of the four are collinear, so the answer is never zero.
template <class Kernel>
[[gnu::always_inline]] inline bool inside_circle(const typename Kernel::Point& a,
                                                 const typename Kernel::Point& b,
                                                 const typename Kernel::Point& c,
                                                 const typename Kernel::Point& p) {
  const int sign = Kernel::in_circle(a, b, c, p);
  if (sign != 0) [[likely]]
    return sign > 0;
  return inside_perturbed_circle<Kernel>(a, b, c, p);
}

/// True if p, collinear with a and b, is strictly between them.
template <class Point>
bool between(const Point& a, const Point& p, const Point& b) {
  return lexicographically_less(a, b)
             ? lexicographically_less(a, p) && lexicographically_less(p, b)
             : lexicographically_less(b, p) && lexicographically_less(p, a);
}

/// True if p is in conflict with the ghost triangle beyond the hull edge a -> b that has the
/// outside on its left: if it is strictly outside, or inside the open edge.
template <class Kernel>
bool inside_ghost(const typename Kernel::Point& a, const typename Kernel::Point& b,
                  const typename Kernel::Point& p) {
  const int side = Kernel::orientation(a, b, p);
  return side > 0 || (side == 0 && between(a, p, b));
}

/// True if p, which is not a corner, is in conflict with a triangle, ghost or not. `point`: the
/// points of the vertices.
template <class Kernel>
[[gnu::always_inline]] inline bool in_conflict(const typename Kernel::Point* point,
                                               const Triangle& t, const typename Kernel::Point& p) {
  const auto& [a, b, c] = t.corner;
  if (!has_ghost(t.corner)) [[likely]]
    return inside_circle<Kernel>(point[a], point[b], point[c], p);
  if (a == kGhost) return inside_ghost<Kernel>(point[b], point[c], p);
  if (b == kGhost) return inside_ghost<Kernel>(point[c], point[a], p);
  return inside_ghost<Kernel>(point[a], point[b], p);
}

}  // namespace terrace::tri::planar
