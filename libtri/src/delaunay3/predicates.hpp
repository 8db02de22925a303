// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "in_sphere.hpp"
#include "mesh.hpp"

/// The kernel's predicates, made strict by symbolic perturbation and extended to ghosts.

namespace terrace::tri::spatial {

/// Orientation of a tetrahedron's corners with p in place of corner i: > 0 if p is on the same side
/// of facet i as that corner.
template <class Kernel>
int orientation_with(const typename Kernel::Vertex* vertex, const Tetrahedron& t, std::uint32_t i,
                     const typename Kernel::Point& p) {
  const auto& f = kFacet[i];
  return Kernel::orientation(p, vertex[t.corner[f[0]]].point, vertex[t.corner[f[1]]].point,
                             vertex[t.corner[f[2]]].point);
}

/// True if p, cospherical with the four points in order, is inside their sphere after the
/// perturbation: every lifted point is raised infinitesimally, the lexicographically larger
/// infinitely more. Of the five only the largest counts. If it is p, p is outside. If it is another
/// one, the lifted hyperplane tilts about the other three, and p is below it on the side of the
/// raised one. If p is in the plane of those three, the second largest decides: then no other four
/// of the points are coplanar.
template <class Point, class Orientation>
[[gnu::noinline]] bool inside_perturbed_sphere(std::array<const Point*, 4> corner, const Point& p,
                                               Orientation orientation) {
  std::size_t largest = 4;
  for (int round = 0; round < 2; ++round) {
    const std::size_t before = largest;
    largest = before == 0 ? 1 : 0;
    for (std::size_t i = largest + 1; i < 4; ++i)
      if (i != before && lexicographically_less(*corner[largest], *corner[i])) largest = i;
    if (lexicographically_less(*corner[largest], p)) return false;
    std::array<const Point*, 4> with = corner;
    with[largest] = &p;
    const int turn = orientation(*with[0], *with[1], *with[2], *with[3]);
    if (turn != 0) return turn > 0;
  }
  assert(false);
  return false;
}

template <class Kernel>
bool inside_perturbed_sphere(const typename Kernel::Point& a, const typename Kernel::Point& b,
                             const typename Kernel::Point& c, const typename Kernel::Point& d,
                             const typename Kernel::Point& p) {
  return inside_perturbed_sphere<typename Kernel::Point>({&a, &b, &c, &d}, p, Kernel::orientation);
}

/// True if p, different from the corners, is inside the sphere through a, b, c, d, which are in
/// order, after the perturbation. Uses exact arithmetic from the start, for callers that have not
/// applied a filter.
template <class Kernel>
bool inside_sphere_exactly(const typename Kernel::Point& a, const typename Kernel::Point& b,
                           const typename Kernel::Point& c, const typename Kernel::Point& d,
                           const typename Kernel::Point& p) {
  const int sign = Kernel::in_sphere(a, b, c, d, p);
  return sign != 0 ? sign > 0 : inside_perturbed_sphere<Kernel>(a, b, c, d, p);
}

/// The same, but applies the filter first.
template <class Kernel>
bool inside_sphere(const typename Kernel::Vertex& a, const typename Kernel::Vertex& b,
                   const typename Kernel::Vertex& c, const typename Kernel::Vertex& d,
                   const typename Kernel::Point& p, const typename Kernel::Lattice& lattice) {
  const Verdict filtered = typename Kernel::Probe(p, lattice).side(a, b, c, d);
  if (filtered != Verdict::open) return filtered == Verdict::in;
  return inside_sphere_exactly<Kernel>(a.point, b.point, c.point, d.point, p);
}

/// A point to insert, which is tested against tetrahedra.
template <class Kernel>
class Conflicts {
 public:
  using Point = typename Kernel::Point;
  using Vertex = typename Kernel::Vertex;

  Conflicts(const Mesh<Kernel>& mesh, const Point& p)
      : vertex_(mesh.vertex.data()),
        tetrahedron_(mesh.tetrahedron.data()),
        point_(p),
        probe_(p, mesh.lattice) {}

  /// The filter's verdict, or kOpen for ghosts.
  [[gnu::always_inline]] Verdict filter(const Tetrahedron& t) const {
    const auto& [a, b, c, d] = t.corner;
    if (has_ghost(t.corner)) [[unlikely]]
      return Verdict::open;
    return probe_.side(vertex_[a], vertex_[b], vertex_[c], vertex_[d]);
  }
  /// True if the point, which is not a corner, is in conflict with a tetrahedron for which filter()
  /// returned kOpen.
  [[nodiscard, gnu::noinline]] bool decide(const Tetrahedron& t) const {
    const std::uint32_t ghost = ghost_index(t.corner);
    if (ghost == 4) return decide_finite(t);
    // A point beyond the hull facet is in conflict. In the plane of the facet, the sphere of the
    // adjacent finite tetrahedron decides: it intersects the plane in the facet's circle, perturbed
    // in the same way.
    const int side = orientation_with<Kernel>(vertex_, t, ghost, point_);
    if (side != 0) return side > 0;
    return decide_finite(tetrahedron_[tetrahedron_of(t.mate[ghost])]);
  }
  [[nodiscard]] bool operator()(const Tetrahedron& t) const {
    const Verdict filtered = filter(t);
    return filtered == Verdict::in || (filtered == Verdict::open && decide(t));
  }

 private:
  [[nodiscard]] bool decide_finite(const Tetrahedron& t) const {
    const auto& a = vertex_[t.corner[0]].point;
    const auto& b = vertex_[t.corner[1]].point;
    const auto& c = vertex_[t.corner[2]].point;
    const auto& d = vertex_[t.corner[3]].point;
    return inside_sphere_exactly<Kernel>(a, b, c, d, point_);
  }

  const Vertex* vertex_;
  const Tetrahedron* tetrahedron_;
  const Point& point_;
  typename Kernel::Probe probe_;
};

}  // namespace terrace::tri::spatial
