// SPDX-License-Identifier: Apache-2.0
#include <sstream>

#include "access.hpp"
#include "predicates.hpp"

namespace terrace::tri {
namespace {

using namespace planar;

template <class Kernel>
class Inspection {
 public:
  explicit Inspection(const Mesh<Kernel>& mesh) : mesh_(mesh) {}

  std::string run() {
    check_vertices();
    if (mesh_.flat) {
      check_line();
    } else {
      check_triangles();
    }
    check_marks();
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
    for (std::uint32_t v = 1; v < mesh_.point.size(); ++v) alive += mesh_.vertex_alive(v) ? 1 : 0;
    expect(alive == mesh_.vertex_count, "vertex count ", mesh_.vertex_count, ", found ", alive);
    for (std::uint32_t v = 1; v < mesh_.point.size(); ++v)
      expect(mesh_.vertex_alive(v) != mesh_.free_vertices.contains(v), "vertex ", v,
             " is free and alive, or neither");
    const std::size_t free = mesh_.free_vertices.count();
    expect(alive + free + 1 == mesh_.point.size(), free, " free vertices, not ",
           mesh_.point.size() - 1 - alive);
    expect((mesh_.last_vertex == kNone) == (alive == 0), "last vertex is missing or superfluous");
    if (alive > 0) expect(mesh_.vertex_alive(mesh_.last_vertex), "last vertex is dead");
  }

  void check_line() {
    expect(mesh_.line.size() == mesh_.vertex_count, "line has ", mesh_.line.size(), " vertices");
    for (std::size_t i = 0; i < mesh_.line.size(); ++i) {
      expect(mesh_.vertex_alive(mesh_.line[i]), "vertex on the line is dead");
      expect(mesh_.incident[mesh_.line[i]] == kNoIncident, "flat vertex has a triangle");
      if (i > 0)
        expect(lexicographically_less(mesh_.point[mesh_.line[i - 1]], mesh_.point[mesh_.line[i]]),
               "line is not sorted at ", i);
      if (i > 1)
        expect(Kernel::orientation(mesh_.point[mesh_.line[0]], mesh_.point[mesh_.line[1]],
                                   mesh_.point[mesh_.line[i]]) == 0,
               "line is bent at ", i);
    }
    for (std::uint32_t t = 0; t < mesh_.triangle.size(); ++t)
      expect(mesh_.triangle[t].corner[0] == kFreeCorner, "triangle ", t, " while flat");
  }

  void check_triangles() {
    std::uint32_t used = 0;
    for (std::uint32_t t = 0; t < mesh_.triangle.size(); ++t) {
      if (mesh_.triangle[t].corner[0] == kFreeCorner) continue;
      ++used;
      check_triangle(t);
    }
    expect(used == 2 * mesh_.vertex_count - 2, used, " triangles for ", mesh_.vertex_count,
           " vertices");
    for (std::uint32_t t = 0; t < mesh_.triangle.size(); ++t)
      expect((mesh_.triangle[t].corner[0] == kFreeCorner) == mesh_.free_triangles.contains(t),
             "triangle ", t, " is free and alive, or neither");
    const std::size_t free = mesh_.free_triangles.count();
    expect(used + free == mesh_.triangle.size(), free, " free triangles of ",
           mesh_.triangle.size());
    for (std::uint32_t v = 0; v < mesh_.point.size(); ++v) {
      if (v != kGhost && !mesh_.vertex_alive(v)) continue;
      const std::uint32_t t = mesh_.incident[v];
      expect(t < mesh_.triangle.size() && mesh_.triangle[t].corner[0] != kFreeCorner &&
                 (mesh_.triangle[t].corner[0] == v || mesh_.triangle[t].corner[1] == v ||
                  mesh_.triangle[t].corner[2] == v),
             "vertex ", v, " is not a corner of its triangle ", t);
    }
  }

  void check_triangle(std::uint32_t t) {
    const Triangle& at = mesh_.triangle[t];
    const bool finite = !has_ghost(at.corner);
    for (std::uint32_t i = 0; i < 3; ++i) {
      expect(at.corner[i] == kGhost || mesh_.vertex_alive(at.corner[i]), "triangle ", t,
             " has dead corner ", at.corner[i]);
      const std::uint32_t other = triangle_of(at.mate[i]);
      const std::uint32_t k = index_of(at.mate[i]);
      expect(other < mesh_.triangle.size() && k < 3, "triangle ", t, " has no mate ", i);
      if (!fault_.empty()) return;
      const Triangle& neighbour = mesh_.triangle[other];
      expect(neighbour.mate[k] == make_side(t, i), "mates ", t, " and ", other, " differ");
      expect(neighbour.corner[next_index(k)] == at.corner[previous_index(i)] &&
                 neighbour.corner[previous_index(k)] == at.corner[next_index(i)],
             "mates ", t, " and ", other, " have no common edge");
      const std::uint32_t opposite = neighbour.corner[k];
      expect(opposite != at.corner[i], "triangles ", t, " and ", other, " are the same");
      if (fault_.empty() && opposite != kGhost)
        expect(!in_conflict<Kernel>(mesh_.point.data(), at, mesh_.point[opposite]), "vertex ",
               opposite, " is inside the circle of triangle ", t);
    }
    if (finite && fault_.empty())
      expect(Kernel::orientation(mesh_.point[at.corner[0]], mesh_.point[at.corner[1]],
                                 mesh_.point[at.corner[2]]) > 0,
             "triangle ", t, " is not counter-clockwise");
  }

  void check_marks() {
    for (std::uint32_t v = 0; v < mesh_.mark.size(); ++v)
      expect(mesh_.mark[v] == 0, "mark of vertex ", v, " is not reset");
  }

  const Mesh<Kernel>& mesh_;
  std::string fault_;
};

}  // namespace

template <class Coord, class Metric>
std::string find_fault(const Delaunay2<Coord, Metric>& triangulation) {
  [[maybe_unused]] const auto scope = Delaunay2Access::scope(triangulation);
  return Inspection(Delaunay2Access::mesh(triangulation)).run();
}

#ifdef TERRACE_TRI_CORE
template std::string find_fault(const Delaunay2<std::int32_t>&);
template std::string find_fault(const Delaunay2<std::int32_t, Windowed>&);
#else
template std::string find_fault(const Delaunay2<double>&);
template std::string find_fault(const Delaunay2<double, EllipticalMetric2>&);
#endif

}  // namespace terrace::tri
