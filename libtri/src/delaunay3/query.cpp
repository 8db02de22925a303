// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <type_traits>

#include <terrace/base/random.hpp>

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "int_kernel.hpp"
#include "operations.hpp"
#include "star.hpp"
#include "walk.hpp"

namespace terrace::tri::spatial {
namespace {

template <class Kernel>
Location3 locate_flat(const Mesh<Kernel>& mesh, const typename Kernel::Point& p) {
  Location3 result;
  if (mesh.flat_vertices.empty()) return result;
  auto at = std::lower_bound(mesh.flat_vertices.begin(), mesh.flat_vertices.end(), p,
                             [&](std::uint32_t v, const auto& value) {
                               return lexicographically_less(mesh.vertex[v].point, value);
                             });
  if (at == mesh.flat_vertices.end()) --at;
  result.vertex = VertexId{*at};
  if (same_point(mesh.vertex[*at].point, p)) result.place = Place3::vertex;
  return result;
}

/// True if a is preferred to b as the vertex nearest to p.
template <class Kernel>
bool nearer(const Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t a,
            std::uint32_t b) {
  const auto& at_a = mesh.vertex[a].point;
  const auto& at_b = mesh.vertex[b].point;
  const int order = Kernel::compare_distance(p, at_a, at_b);
  return order < 0 || (order == 0 && lexicographically_less(at_a, at_b));
}

/// A neighbour of the vertex that is preferred to it, or the vertex itself.
template <class Kernel>
std::uint32_t better_neighbour(const Mesh<Kernel>& mesh, const typename Kernel::Point& p,
                               std::uint32_t vertex) {
  std::uint32_t best = vertex;
  Star<Kernel> star(mesh, vertex);
  for (std::uint32_t t = star.next(); t != kNone; t = star.next()) {
    for (const std::uint32_t v : mesh.tetrahedron[t].corner)
      if (v != kGhost && v != best && nearer(mesh, p, v, best)) best = v;
    if (best != vertex) break;
  }
  return best;
}

template <class Coord>
std::uint64_t bits(Coord c) {
  if constexpr (std::is_integral_v<Coord>) {
    return static_cast<std::uint64_t>(c);
  } else {
    return std::bit_cast<std::uint64_t>(c + 0.0);  // merges -0.0 and 0.0
  }
}

template <class Point>
std::uint64_t hash_point(std::uint64_t h, const Point& p) {
  for (const auto c : p) h = base::splitmix64(h ^ bits(c));
  return h;
}

}  // namespace

template <class Kernel>
Location3 locate(const Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t hint) {
  if (mesh.flat) return locate_flat(mesh, p);
  const WalkEnd end = walk(mesh, p, mesh.vertex[hint == kNone ? mesh.last_vertex : hint].incident);
  const Tetrahedron& at = mesh.tetrahedron[end.tetrahedron];
  Location3 result;
  if (end.outside) {
    const Side side = at.mate[ghost_index(at.corner)];
    result.tetrahedron = TetrahedronId{tetrahedron_of(side)};
    result.corner[0] = static_cast<std::uint8_t>(index_of(side));
    result.vertex =
        VertexId{mesh.tetrahedron[tetrahedron_of(side)].corner[(index_of(side) + 1) % 4]};
    return result;
  }
  result.tetrahedron = TetrahedronId{end.tetrahedron};
  const std::uint32_t equal = equal_corner(mesh, end.tetrahedron, p);
  if (equal != kNone) {
    result.place = Place3::vertex;
    result.vertex = VertexId{equal};
    return result;
  }
  result.place = Place3::inside;
  std::array<bool, 4> on{};
  for (std::uint32_t i = 0; i < 4; ++i) {
    on[i] = orientation_with<Kernel>(mesh.vertex.data(), at, i, p) == 0;
    if (!on[i]) {
      result.vertex = VertexId{at.corner[i]};
    } else if (result.place == Place3::inside) {
      result.place = Place3::facet;
      result.corner[0] = static_cast<std::uint8_t>(i);
    } else {
      result.place = Place3::edge;
      result.corner[1] = static_cast<std::uint8_t>(i);
    }
  }
  return result;
}

// A vertex that is not nearest has a neighbour that is nearer. The nearest vertices are all on one
// empty sphere about p and are the corners of a convex polytope whose edges exist. Moving to better
// neighbours therefore ends at the best vertex.
template <class Kernel>
std::uint32_t nearest(const Mesh<Kernel>& mesh, const typename Kernel::Point& p,
                      std::uint32_t hint) {
  if (mesh.vertex_count == 0) return kNone;
  if (mesh.flat)
    return *std::min_element(
        mesh.flat_vertices.begin(), mesh.flat_vertices.end(),
        [&](std::uint32_t a, std::uint32_t b) { return nearer(mesh, p, a, b); });
  const WalkEnd end = walk(mesh, p, mesh.vertex[hint == kNone ? mesh.last_vertex : hint].incident);
  const Tetrahedron& start = mesh.tetrahedron[mesh.finite_side(end.tetrahedron)];
  std::uint32_t best = start.corner[0];
  for (const std::uint32_t v : start.corner)
    if (v != best && nearer(mesh, p, v, best)) best = v;
  for (std::uint32_t previous = kNone; previous != best;) {
    previous = best;
    best = better_neighbour(mesh, p, best);
  }
  return best;
}

template <class Kernel>
void adjacent(const Mesh<Kernel>& mesh, std::uint32_t vertex, std::vector<VertexId>& result) {
  result.clear();
  if (mesh.flat) return;
  Star<Kernel> star(mesh, vertex);
  for (std::uint32_t t = star.next(); t != kNone; t = star.next())
    for (const std::uint32_t v : mesh.tetrahedron[t].corner)
      if (v != kGhost && v != vertex) result.push_back(VertexId{v});
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
}

template <class Kernel>
void tetrahedra_at(const Mesh<Kernel>& mesh, std::uint32_t vertex,
                   std::vector<TetrahedronId>& result) {
  result.clear();
  if (mesh.flat) return;
  Star<Kernel> star(mesh, vertex);
  for (std::uint32_t t = star.next(); t != kNone; t = star.next())
    if (!has_ghost(mesh.tetrahedron[t].corner)) result.push_back(TetrahedronId{t});
  std::sort(result.begin(), result.end());
}

template <class Kernel>
std::uint64_t hash(const Mesh<Kernel>& mesh) {
  std::uint64_t sum = 0;
  if (mesh.flat) {
    for (const std::uint32_t v : mesh.flat_vertices) sum += hash_point(0, mesh.vertex[v].point);
    return sum;
  }
  for (std::uint32_t t = 0; t < mesh.tetrahedron.size(); ++t) {
    if (!is_finite(mesh.tetrahedron[t].corner)) continue;
    std::array<const typename Kernel::Point*, 4> points;
    for (std::size_t i = 0; i < 4; ++i)
      points[i] = &mesh.vertex[mesh.tetrahedron[t].corner[i]].point;
    std::sort(points.begin(), points.end(),
              [](const auto* a, const auto* b) { return lexicographically_less(*a, *b); });
    std::uint64_t h = 0;
    for (const auto* p : points) h = hash_point(h, *p);
    sum += h;
  }
  return sum;
}

#define TERRACE_INSTANTIATE(Kernel)                                                             \
  template Location3 locate(const Mesh<Kernel>&, const Kernel::Point&, std::uint32_t);          \
  template std::uint32_t nearest(const Mesh<Kernel>&, const Kernel::Point&, std::uint32_t);     \
  template void adjacent(const Mesh<Kernel>&, std::uint32_t, std::vector<VertexId>&);           \
  template void tetrahedra_at(const Mesh<Kernel>&, std::uint32_t, std::vector<TetrahedronId>&); \
  template std::uint64_t hash(const Mesh<Kernel>&);
#ifdef TERRACE_TRI_CORE
TERRACE_INSTANTIATE(IntKernel)
#else
TERRACE_INSTANTIATE(DoubleKernel)
TERRACE_INSTANTIATE(EllipticalKernel)
#endif
#undef TERRACE_INSTANTIATE

}  // namespace terrace::tri::spatial
