// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

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

class HeightPatches;

/// How a terrain slides over a step instead of popping: start and end positions of each vertex that
/// came or went or whose height changed. x and y do not change.
///
/// A new vertex starts on the surface before the step and ends at its own height: draw the new
/// triangles with `added` and `reassigned` going from start to end. A removed vertex goes from its
/// height to the surface after the step: a renderer that draws the old triangles until the slide is
/// over moves `removed`, and `reassigned`, in the same way. Collapse mirrors expand: a step and its
/// inverse give the same slides with start and end exchanged.
///
/// A vertex outside the other surface (the hull grew, or there were no triangles) stays at its own
/// height.
template <class Coord>
class Geomorph2 {
 public:
  using Model = MultiresolutionModel<Delaunay2<Coord>>;

  Geomorph2();
  ~Geomorph2();

  Slides added, removed, reassigned;

  /// delta: of the model's last step, which needs ModelOptions::old_heights. Replaces the slides.
  /// with_removed: false leaves `removed` empty, for renderers that do not draw what has gone.
  /// O(n log n) in the size of the delta. Throws std::invalid_argument for a delta without heights.
  void make(const Model& model, const typename Model::Delta& delta, bool with_removed = true);

 private:
  [[nodiscard]] Point3 old_position(const Model& model, VertexId vertex) const;

  // By slot: the positions before the step of vertices that have moved since.
  std::vector<std::uint32_t> old_index_;  // into old_positions_; kAsNow: the current position
  std::vector<Point3> old_positions_;
  std::unique_ptr<HeightPatches> patches_;
};

extern template class Geomorph2<std::int32_t>;
extern template class Geomorph2<double>;

}  // namespace terrace::tri
