// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "terrace/tri/multiresolution.hpp"

namespace terrace::tri {

/// Vertices that slide, in columns: vertices[i] goes from start[i] to end[i].
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

/// Triangles over the plane with heights, none over another, in which points are found. Build it,
/// ask, build it again; a tree of boxes over the triangles, O(n log n) to build, about O(log n) a
/// question.
class HeightPatches {
 public:
  using Corner = Point3;
  void clear() { triangles_.clear(); }
  void add(const Corner& a, const Corner& b, const Corner& c) { triangles_.push_back({a, b, c}); }
  void build();
  /// The height of the surface above x, y, linear in the triangle that holds the point; none if
  /// no triangle does, to within rounding.
  [[nodiscard]] std::optional<double> height(double x, double y) const;

 private:
  struct Node {
    std::array<double, 4> box;   // least x, y, greatest x, y
    std::uint32_t first, count;  // triangles of a leaf; count 0: the children are at first, first+1
  };
  // Thrice the middle of a triangle.
  struct Place {
    double x, y;
    std::uint32_t triangle;
  };
  void split(std::uint32_t node, std::uint32_t first, std::uint32_t last);

  std::vector<std::array<Corner, 3>> triangles_, sorted_;
  std::vector<Place> places_;
  std::vector<Node> nodes_;
};

/// How a terrain slides over a step instead of popping: for each vertex that came or went, or whose
/// height changed, where it starts and where it ends. x and y stay.
///
/// A new vertex starts on the surface of before the step and ends at its own height: draw the new
/// triangles with `added` and `reassigned` going from start to end. A removed one goes from its
/// height down to the surface of after the step: a renderer that draws the old triangles until the
/// slide is over moves `removed`, and `reassigned`, likewise. Collapse mirrors expand: what a step
/// and its inverse say is the same with start and end changed over.
///
/// A vertex outside the other surface (the hull grew, or there were no triangles) stays at its own
/// height.
template <class Coord>
class Geomorph2 {
 public:
  using Model = MultiresolutionModel<Delaunay2<Coord>>;

  Slides added, removed, reassigned;

  /// delta: of the model's last step, which needs ModelOptions::old_heights. Replaces the slides.
  /// O(n log n) in what the delta tells. Throws std::invalid_argument for a delta without heights.
  void make(const Model& model, const typename Model::Delta& delta);

 private:
  [[nodiscard]] Point3 old_position(const Model& model, VertexId vertex) const;

  // Of before the step, by slot: positions of vertices that are not what they were.
  std::vector<std::uint32_t> old_index_;  // into old_positions_; kAsNow: as now
  std::vector<Point3> old_positions_;
  HeightPatches patches_;
};

extern template class Geomorph2<std::int32_t>;
extern template class Geomorph2<double>;

}  // namespace terrace::tri
