// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <sstream>

#include "access.hpp"
#include "flat.hpp"
#include "predicates.hpp"

namespace terrace::tri {
namespace {

using namespace spatial;

template <class Kernel>
class Inspection {
 public:
  explicit Inspection(const Mesh<Kernel>& mesh) : mesh_(mesh) {}

  std::string run() {
    check_vertices();
    if (mesh_.flat) {
      check_flat();
    } else {
      check_tetrahedra();
    }
    for (std::uint32_t t = 0; t < mesh_.mark.size(); ++t)
      expect(mesh_.mark[t] == kUnknown, "mark of tetrahedron ", t, " is not reset");
    return fault_;
  }

 private:
  template <class... Parts>
  void expect(bool condition, const Parts&... parts) {
    if (condition || !fault_.empty()) return;
    std::ostringstream text;
    (text << ... << parts);
    fault_ = text.str();
  }

  void check_vertices() {
    std::uint32_t alive = 0;
    for (std::uint32_t v = 1; v < mesh_.vertex.size(); ++v) alive += mesh_.vertex_alive(v) ? 1 : 0;
    expect(alive == mesh_.vertex_count, "vertex count ", mesh_.vertex_count, ", found ", alive);
    std::uint32_t free = 0;
    for (std::uint32_t v = mesh_.free_vertex; v != kFreeVertexBit - 1 && free < mesh_.vertex.size();
         v = mesh_.vertex[v].incident & ~kFreeVertexBit) {
      expect(!mesh_.vertex_alive(v), "vertex ", v, " is in the free list and alive");
      ++free;
    }
    expect(alive + free + 1 == mesh_.vertex.size(), "free list of vertices has ", free, ", not ",
           mesh_.vertex.size() - 1 - alive);
    expect((mesh_.last_vertex == kNone) == (alive == 0), "last vertex is missing or superfluous");
    if (alive > 0) expect(mesh_.vertex_alive(mesh_.last_vertex), "last vertex is dead");
    expect(mesh_.vertex[kGhost].incident == kNoIncident, "the ghost's vertex was written");
  }

  void check_flat() {
    const auto& flat_vertices = mesh_.flat_vertices;
    expect(flat_vertices.size() == mesh_.vertex_count, flat_vertices.size(), " flat vertices");
    for (std::size_t i = 0; i < flat_vertices.size(); ++i) {
      expect(mesh_.vertex_alive(flat_vertices[i]), "flat vertex is dead");
      expect(mesh_.vertex[flat_vertices[i]].incident == kNoIncident,
             "flat vertex has a tetrahedron");
      if (i > 0)
        expect(lexicographically_less(mesh_.vertex[flat_vertices[i - 1]].point,
                                      mesh_.vertex[flat_vertices[i]].point),
               "waiting list is not sorted at ", i);
    }
    for (const std::uint32_t v : mesh_.basis)
      expect(mesh_.vertex_alive(v), "vertex of the basis is dead");
    if (!fault_.empty()) return;
    std::vector<std::uint32_t> basis = mesh_.basis;
    for (const std::uint32_t v : flat_vertices) {
      expect(extend_basis(mesh_, basis, v), "waiting vertex ", v, " is off the plane");
      expect(basis == mesh_.basis, "vertex ", v, " is off the basis");
    }
    for (std::uint32_t t = 0; t < mesh_.tetrahedron.size(); ++t)
      expect(mesh_.tetrahedron[t].corner[0] == kFreeCorner, "tetrahedron ", t, " while flat");
  }

  void check_tetrahedra() {
    expect(mesh_.flat_vertices.empty() && mesh_.basis.empty(), "vertices wait, but it is not flat");
    std::uint32_t used = 0;
    std::uint32_t finite = 0;
    for (std::uint32_t t = 0; t < mesh_.tetrahedron.size(); ++t) {
      if (mesh_.tetrahedron[t].corner[0] == kFreeCorner) continue;
      ++used;
      finite += mesh_.tetrahedron_alive(t) ? 1 : 0;
      check_tetrahedron(t);
    }
    expect(finite == mesh_.finite_count, finite, " finite tetrahedra, counted ",
           mesh_.finite_count);
    std::uint32_t free = 0;
    for (std::uint32_t t = mesh_.free_tetrahedron; t != kNone && free <= mesh_.tetrahedron.size();
         t = mesh_.tetrahedron[t].corner[1]) {
      expect(mesh_.tetrahedron[t].corner[0] == kFreeCorner, "tetrahedron ", t,
             " is free and alive");
      ++free;
    }
    expect(used + free == mesh_.tetrahedron.size(), "free list of tetrahedra has ", free);
    for (std::uint32_t v = 1; v < mesh_.vertex.size(); ++v) {
      if (!mesh_.vertex_alive(v)) continue;
      const std::uint32_t t = mesh_.vertex[v].incident;
      expect(t < mesh_.tetrahedron.size() && mesh_.tetrahedron[t].corner[0] != kFreeCorner &&
                 has_corner(mesh_.tetrahedron[t], v),
             "vertex ", v, " is not a corner of its tetrahedron ", t);
    }
  }

  static bool has_corner(const Tetrahedron& t, std::uint32_t v) {
    return t.corner[0] == v || t.corner[1] == v || t.corner[2] == v || t.corner[3] == v;
  }

  void check_tetrahedron(std::uint32_t t) {
    const Tetrahedron& at = mesh_.tetrahedron[t];
    for (std::uint32_t i = 0; i < 4; ++i) {
      expect(at.corner[i] == kGhost || mesh_.vertex_alive(at.corner[i]), "tetrahedron ", t,
             " has dead corner ", at.corner[i]);
      for (std::uint32_t k = 0; k < i; ++k)
        expect(at.corner[i] != at.corner[k], "tetrahedron ", t, " has a corner twice");
    }
    for (std::uint32_t i = 0; i < 4 && fault_.empty(); ++i) check_side(t, i);
    if (!fault_.empty() || has_ghost(at.corner)) return;
    expect(
        orientation_with<Kernel>(mesh_.vertex.data(), at, 0, mesh_.vertex[at.corner[0]].point) > 0,
        "tetrahedron ", t, " is turned over or flat");
  }

  void check_side(std::uint32_t t, std::uint32_t i) {
    const Tetrahedron& at = mesh_.tetrahedron[t];
    const std::uint32_t other = tetrahedron_of(at.mate[i]);
    const std::uint32_t k = index_of(at.mate[i]);
    expect(other < mesh_.tetrahedron.size(), "tetrahedron ", t, " has no mate ", i);
    if (!fault_.empty()) return;
    const Tetrahedron& neighbour = mesh_.tetrahedron[other];
    expect(neighbour.corner[0] != kFreeCorner, "mate ", i, " of ", t, " is free");
    expect(neighbour.mate[k] == make_side(t, i), "mates ", t, " and ", other, " differ");
    auto facet = facet_of(at, i);
    auto reversed = facet_of(neighbour, k);
    std::swap(reversed[0], reversed[1]);
    for (int turn = 0; turn < 3 && facet != reversed; ++turn)
      std::rotate(facet.begin(), facet.begin() + 1, facet.end());
    expect(facet == reversed, "mates ", t, " and ", other, " have no common facet");
    const std::uint32_t opposite = neighbour.corner[k];
    expect(opposite != at.corner[i], "tetrahedra ", t, " and ", other, " are the same");
    if (!fault_.empty() || opposite == kGhost) return;
    const Conflicts<Kernel> conflicts(mesh_, mesh_.vertex[opposite].point);
    expect(!conflicts(at), "vertex ", opposite, " is inside the sphere of tetrahedron ", t);
  }

  const Mesh<Kernel>& mesh_;
  std::string fault_;
};

}  // namespace

template <class Coord, class Metric>
std::string find_fault(const Delaunay3<Coord, Metric>& triangulation) {
  [[maybe_unused]] const auto scope = Delaunay3Access::scope(triangulation);
  return Inspection(Delaunay3Access::mesh(triangulation)).run();
}

#ifdef TERRACE_TRI_CORE
template std::string find_fault(const Delaunay3<std::int32_t>&);
#else
template std::string find_fault(const Delaunay3<double>&);
template std::string find_fault(const Delaunay3<double, EllipticalMetric3>&);
#endif

}  // namespace terrace::tri
