// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "terrace/tri/dynamic_surface.hpp"
#include "terrace/tri/multiresolution.hpp"
#include "terrace/tri/thinned_delaunay2.hpp"

namespace terrace::tri {

/// Sliding vertices, in columns: vertices[i] moves from start[i] to end[i].
struct Slides {
  std::vector<VertexId> vertices;
  std::vector<Point3> start, end;

  [[nodiscard]] std::size_t size() const { return vertices.size(); }
  void clear() {
    vertices.clear();
    start.clear();
    end.clear();
  }
  void add(VertexId vertex, const Point3& from, const Point3& to) {
    vertices.push_back(vertex);
    start.push_back(from);
    end.push_back(to);
  }
};

/// A position that has left the surface and slides onto it. `end` is on the triangle `on`.
/// kNoTriangle means that it is not on any triangle, permanently.
struct Anchor {
  Point3 place{}, end{};
  TriangleId on = kNoTriangle;
  bool moved = false;  ///< by the last step
};

/// The slides that turn a step into a smooth transition instead of a pop: start and end positions
/// of each vertex that was added or removed or whose height changed.
///
/// A new vertex starts on the surface before the step and ends at its own position: draw the new
/// triangles while `added` and `reassigned` move from start to end. A removed vertex moves from its
/// position to the surface after the step: a renderer that draws the old triangles until the end of
/// the slide moves `removed` and `reassigned` in the same way. A collapse mirrors an expansion: a
/// step and its inverse give the same slides with start and end exchanged.
///
/// Over the plane (Delaunay2, ThinnedDelaunay2) x and y do not change. A vertex outside the other
/// surface (because the hull grew, or because there were no triangles) keeps its own height.
///
/// In space (DynamicSurface) a vertex moves to the nearest point on the triangles that the step
/// exchanged within the vertex's own connected part, so it does not cross to the other side of a
/// thin body. Without such triangles it keeps its position. `added` and `removed` are the vertices
/// that joined and left the surface. A few of these have tetrahedra before and after. `reassigned`
/// is empty because positions do not change. The slides of an inverse step mirror those of the step
/// wherever the surface itself returns. In a few pockets it depends on the order in which its
/// points came.
template <class Triangulation>
class Geomorph {
 public:
  using Model = MultiresolutionModel<Triangulation>;

  Geomorph();
  ~Geomorph();

  Slides added, removed, reassigned;

  /// The connected parts of the step. The triangles that a part exchanges may be drawn as before
  /// the step while those of other parts are drawn as after it. The arrays hold the number of the
  /// part, less than `count`, that each of the delta's triangles and each vertex of `added` and
  /// `removed` belongs to.
  struct Parts {
    std::size_t count = 0;
    std::vector<std::uint32_t> removed_triangles, added_triangles, removed, added;
  };
  /// Empty without with_removed, as is the list of triangles to which the vertices of `removed`
  /// move.
  Parts parts;
  std::vector<TriangleId> removed_on;

  /// Replaces slides and parts by those of the model's last step, `delta`, which over the plane
  /// needs ModelOptions::old_heights. with_removed: false leaves `removed` empty, for renderers
  /// that do not draw removed triangles. anchors: the anchors of earlier steps. Those whose
  /// triangle was removed move to the triangles that replace it and are projected onto them in the
  /// same way. O(n log n) in the size of the delta, 0.7 us per vertex in space. Throws
  /// std::invalid_argument for a delta over the plane without heights.
  void make(const Model& model, const typename Model::Delta& delta, bool with_removed = true,
            std::span<Anchor> anchors = {});

 private:
  struct Scratch;
  std::unique_ptr<Scratch> scratch_;
};

template <class Coord>
using Geomorph2 = Geomorph<Delaunay2<Coord>>;

extern template class Geomorph<Delaunay2<std::int32_t>>;
extern template class Geomorph<ThinnedDelaunay2>;
extern template class Geomorph<Delaunay2<double>>;
extern template class Geomorph<DynamicSurface<std::int32_t>>;
extern template class Geomorph<DynamicSurface<double>>;

}  // namespace terrace::tri
