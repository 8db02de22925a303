// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "terrace/tri/dynamic_surface.hpp"
#include "terrace/tri/multiresolution.hpp"

namespace terrace::tri {

/// Vertices that slide, as columns: vertices[i] goes from start[i] to end[i].
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

/// A place that has gone from the surface and slides onto it: `end` is on the triangle `on`;
/// kNoTriangle: on none, for good.
struct Anchor {
  Point3 place{}, end{};
  TriangleId on = kNoTriangle;
  bool moved = false;  ///< by the last step
};

/// How a surface slides over a step instead of popping: start and end positions of each vertex that
/// came or went or whose height changed.
///
/// A new vertex starts on the surface before the step and ends at its own place: draw the new
/// triangles with `added` and `reassigned` going from start to end. A removed vertex goes from its
/// place to the surface after the step: a renderer that draws the old triangles until the slide is
/// over moves `removed`, and `reassigned`, in the same way. Collapse mirrors expand: a step and its
/// inverse give the same slides with start and end exchanged.
///
/// Over the plane (Delaunay2) x and y do not change; a vertex outside the other surface (the hull
/// grew, or there were no triangles) stays at its own height.
///
/// In space (DynamicSurface) it goes to the nearest place on the triangles that the step has
/// exchanged, of the connected part that it is in, so that it does not cross to the other side of a
/// thin body; it stays at its own place if there are none. `added` and `removed` are the vertices
/// that came to the surface and left it: a few of these are in the tetrahedra before and after.
/// `reassigned` is empty: places do not change. The law of the inverse holds as far as the surface
/// follows it, which in a few pockets depends on how its points came.
template <class Triangulation>
class Geomorph {
 public:
  using Model = MultiresolutionModel<Triangulation>;

  Geomorph();
  ~Geomorph();

  Slides added, removed, reassigned;

  /// The connected parts of the step: what a part exchanges can be drawn as before while others are
  /// drawn as after. The number of the part, less than `count`, that each of the delta's triangles
  /// and each vertex of `added` and `removed` belongs to.
  struct Parts {
    std::size_t count = 0;
    std::vector<std::uint32_t> removed_triangles, added_triangles, removed, added;
  };
  /// Empty without with_removed, as is the triangle that each of `removed` goes to.
  Parts parts;
  std::vector<TriangleId> removed_on;

  /// delta: of the model's last step, which over the plane needs ModelOptions::old_heights.
  /// Replaces slides and parts. with_removed: false leaves `removed` empty, for renderers that do
  /// not draw what has gone. anchors: of earlier steps; those whose triangle has gone are moved to
  /// what replaces it, where their place is projected likewise. O(n log n) in the size of the
  /// delta, 0.7 us per vertex in space. Throws std::invalid_argument for a delta over the plane
  /// without heights.
  void make(const Model& model, const typename Model::Delta& delta, bool with_removed = true,
            std::span<Anchor> anchors = {});

 private:
  struct Scratch;
  std::unique_ptr<Scratch> scratch_;
};

template <class Coord>
using Geomorph2 = Geomorph<Delaunay2<Coord>>;

extern template class Geomorph<Delaunay2<std::int32_t>>;
extern template class Geomorph<Delaunay2<double>>;
extern template class Geomorph<DynamicSurface<std::int32_t>>;
extern template class Geomorph<DynamicSurface<double>>;

}  // namespace terrace::tri
