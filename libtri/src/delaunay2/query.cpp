// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>

#include <terrace/base/random.hpp>

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "int_kernel.hpp"
#include "operations.hpp"
#include "walk.hpp"
#include "windowed_kernel.hpp"

namespace terrace::tri::planar {
namespace {

template <class Kernel>
Location locate_flat(const Mesh<Kernel>& mesh, const typename Kernel::Point& p) {
  Location result;
  if (mesh.line.empty()) return result;
  auto at = std::lower_bound(mesh.line.begin(), mesh.line.end(), p,
                             [&](std::uint32_t v, const auto& value) {
                               return lexicographically_less(mesh.point[v], value);
                             });
  if (at == mesh.line.end()) --at;
  result.vertex = VertexId{*at};
  if (mesh.point[*at] == p) result.place = Place::vertex;
  return result;
}

/// True if a is preferred to b as the vertex nearest to p.
template <class Kernel>
bool nearer(const Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t a,
            std::uint32_t b) {
  const int order = Kernel::compare_distance(p, mesh.point[a], mesh.point[b]);
  return order < 0 || (order == 0 && lexicographically_less(mesh.point[a], mesh.point[b]));
}

/// Calls visit(t, i) for the triangles around a vertex counter-clockwise, including ghosts,
/// starting from triangle `start`. Corner i of t is the vertex.
template <class Kernel, class Visit>
void for_star(const Mesh<Kernel>& mesh, std::uint32_t vertex, std::uint32_t start, Visit visit) {
  std::uint32_t t = start;
  do {
    const std::uint32_t i = mesh.corner_index(t, vertex);
    visit(t, i);
    t = triangle_of(mesh.triangle[t].mate[next_index(i)]);
  } while (t != start);
}

template <class Coord>
std::uint64_t bits(Coord c) {
  if constexpr (std::is_same_v<Coord, double>) {
    c += 0.0;  // merges -0.0 and 0.0
    std::uint64_t result = 0;
    std::memcpy(&result, &c, sizeof result);
    return result;
  }
  return static_cast<std::uint64_t>(c);
}

template <class Point>
std::uint64_t hash_points(std::initializer_list<Point> points) {
  std::uint64_t h = 0;
  for (const Point& p : points) h = base::splitmix64(base::splitmix64(h ^ bits(p[0])) ^ bits(p[1]));
  return h;
}

}  // namespace

template <class Kernel>
Location locate(const Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t hint) {
  if (mesh.flat) return locate_flat(mesh, p);
  const WalkEnd end = walk(mesh, p, mesh.incident[hint == kNone ? mesh.last_vertex : hint]);
  const Triangle& at = mesh.triangle[end.triangle];
  Location result;
  if (end.outside) {
    for (std::uint32_t i = 0; i < 3; ++i) {
      if (at.corner[i] != kGhost) continue;
      result.triangle = TriangleId{triangle_of(at.mate[i])};
      result.edge = static_cast<std::uint8_t>(index_of(at.mate[i]));
      result.vertex = VertexId{at.corner[next_index(i)]};
    }
    return result;
  }
  result.triangle = TriangleId{end.triangle};
  const std::uint32_t equal = equal_corner(mesh, end.triangle, p);
  if (equal != kNone) {
    result.place = Place::vertex;
    result.vertex = VertexId{equal};
    return result;
  }
  result.place = Place::inside;
  result.vertex = VertexId{at.corner[0]};
  for (std::uint32_t i = 0; i < 3; ++i) {
    const auto& a = mesh.point[at.corner[next_index(i)]];
    const auto& b = mesh.point[at.corner[previous_index(i)]];
    if (Kernel::orientation(a, b, p) != 0) continue;
    result.place = Place::edge;
    result.edge = static_cast<std::uint8_t>(i);
    result.vertex = VertexId{at.corner[next_index(i)]};
  }
  return result;
}

// A vertex that is not nearest has a neighbour that is nearer. The nearest vertices are all on one
// empty circle about p and are the corners of a convex polygon whose edges exist. Moving to better
// neighbours therefore ends at the best vertex.
template <class Kernel>
std::uint32_t nearest(const Mesh<Kernel>& mesh, const typename Kernel::Point& p,
                      std::uint32_t hint) {
  if (mesh.vertex_count == 0) return kNone;
  if (mesh.flat)
    return *std::min_element(
        mesh.line.begin(), mesh.line.end(),
        [&](std::uint32_t a, std::uint32_t b) { return nearer(mesh, p, a, b); });
  const Triangle& start = mesh.triangle[mesh.finite_side(
      walk(mesh, p, mesh.incident[hint == kNone ? mesh.last_vertex : hint]).triangle)];
  std::uint32_t best = start.corner[0];
  for (std::uint32_t i = 1; i < 3; ++i)
    if (nearer(mesh, p, start.corner[i], best)) best = start.corner[i];
  for (std::uint32_t previous = kNone; previous != best;) {
    previous = best;
    for_star(mesh, previous, mesh.incident[previous], [&](std::uint32_t t, std::uint32_t i) {
      const std::uint32_t v = mesh.triangle[t].corner[next_index(i)];
      if (v != kGhost && nearer(mesh, p, v, best)) best = v;
    });
  }
  return best;
}

template <class Kernel>
void adjacent(const Mesh<Kernel>& mesh, std::uint32_t vertex, std::vector<VertexId>& result) {
  result.clear();
  if (mesh.flat) {
    const auto at = std::find(mesh.line.begin(), mesh.line.end(), vertex);
    if (at != mesh.line.begin()) result.push_back(VertexId{*(at - 1)});
    if (at + 1 != mesh.line.end()) result.push_back(VertexId{*(at + 1)});
    return;
  }
  // A hull vertex has one triangle whose next corner is the ghost. Its successor on the hull
  // follows.
  std::uint32_t start = mesh.incident[vertex];
  for_star(mesh, vertex, mesh.incident[vertex], [&](std::uint32_t t, std::uint32_t i) {
    if (mesh.triangle[t].corner[next_index(i)] == kGhost)
      start = triangle_of(mesh.triangle[t].mate[next_index(i)]);
  });
  for_star(mesh, vertex, start, [&](std::uint32_t t, std::uint32_t i) {
    const std::uint32_t v = mesh.triangle[t].corner[next_index(i)];
    if (v != kGhost) result.push_back(VertexId{v});
  });
}

template <class Kernel>
std::uint32_t degree(const Mesh<Kernel>& mesh, std::uint32_t vertex) {
  std::uint32_t count = 0;
  for_star(mesh, vertex, mesh.incident[vertex], [&](std::uint32_t, std::uint32_t) { ++count; });
  return count;
}

template <class Kernel>
std::uint64_t hash(const Mesh<Kernel>& mesh) {
  using Point = typename Kernel::Point;
  std::uint64_t sum = 0;
  if (mesh.flat) {
    for (const std::uint32_t v : mesh.line) sum += hash_points<Point>({mesh.point[v]});
    return sum;
  }
  for (const Triangle& t : std::span(mesh.triangle.data(), mesh.triangle.size())) {
    if (!is_finite(t.corner)) continue;
    std::uint32_t i = 0;
    for (std::uint32_t k = 1; k < 3; ++k)
      if (lexicographically_less(mesh.point[t.corner[k]], mesh.point[t.corner[i]])) i = k;
    sum += hash_points<Point>({mesh.point[t.corner[i]], mesh.point[t.corner[next_index(i)]],
                               mesh.point[t.corner[previous_index(i)]]});
  }
  return sum;
}

#ifdef TERRACE_TRI_CORE
template Location locate(const Mesh<IntKernel>&, const IntKernel::Point&, std::uint32_t);
template std::uint32_t nearest(const Mesh<IntKernel>&, const IntKernel::Point&, std::uint32_t);
template void adjacent(const Mesh<IntKernel>&, std::uint32_t, std::vector<VertexId>&);
template std::uint32_t degree(const Mesh<IntKernel>&, std::uint32_t);
template std::uint64_t hash(const Mesh<IntKernel>&);
template Location locate(const Mesh<WindowedKernel>&, const WindowedKernel::Point&, std::uint32_t);
template void adjacent(const Mesh<WindowedKernel>&, std::uint32_t, std::vector<VertexId>&);
template std::uint32_t degree(const Mesh<WindowedKernel>&, std::uint32_t);
template std::uint64_t hash(const Mesh<WindowedKernel>&);
#else
template Location locate(const Mesh<DoubleKernel>&, const DoubleKernel::Point&, std::uint32_t);
template Location locate(const Mesh<EllipticalKernel>&, const EllipticalKernel::Point&,
                         std::uint32_t);
template std::uint32_t nearest(const Mesh<DoubleKernel>&, const DoubleKernel::Point&,
                               std::uint32_t);
template std::uint32_t nearest(const Mesh<EllipticalKernel>&, const EllipticalKernel::Point&,
                               std::uint32_t);
template void adjacent(const Mesh<DoubleKernel>&, std::uint32_t, std::vector<VertexId>&);
template void adjacent(const Mesh<EllipticalKernel>&, std::uint32_t, std::vector<VertexId>&);
template std::uint32_t degree(const Mesh<DoubleKernel>&, std::uint32_t);
template std::uint32_t degree(const Mesh<EllipticalKernel>&, std::uint32_t);
template std::uint64_t hash(const Mesh<DoubleKernel>&);
template std::uint64_t hash(const Mesh<EllipticalKernel>&);
#endif

}  // namespace terrace::tri::planar
