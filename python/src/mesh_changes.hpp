// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <terrace/stream/point.hpp>
#include <terrace/tri/multiresolution.hpp>

#include "arrays.hpp"

namespace terrace::python {

/// Vertices and cells (triangles, or tetrahedra with 4 corners) added to and removed from a model
/// of a store's points, as columns.
template <std::size_t Corners>
struct CellChange {
  std::vector<std::int32_t> added_vertices, removed_vertices, moved_vertices;
  std::vector<stream::Point3> added_positions, moved_positions;
  std::vector<std::int32_t> added_cells, removed_cells;
  std::vector<std::array<std::int32_t, Corners>> added_corners;
};
using MeshChange = CellChange<3>;

template <std::size_t Corners>
py::dict dict_of(CellChange<Corners>&& change) {
  py::dict result;
  result["added_vertices"] = to_array(std::move(change.added_vertices));
  result["added_positions"] = to_array(std::move(change.added_positions));
  result["removed_vertices"] = to_array(std::move(change.removed_vertices));
  result["moved_vertices"] = to_array(std::move(change.moved_vertices));
  result["moved_positions"] = to_array(std::move(change.moved_positions));
  result[Corners == 3 ? "added_triangles" : "added_tetrahedra"] =
      to_array(std::move(change.added_cells));
  result["added_corners"] = to_array(std::move(change.added_corners));
  result[Corners == 3 ? "removed_triangles" : "removed_tetrahedra"] =
      to_array(std::move(change.removed_cells));
  return result;
}

template <class Id>
std::int32_t number_of(Id of) {
  return static_cast<std::int32_t>(tri::slot(of));
}

/// Collects the changes of what is shown. place(vertex) returns the position of a vertex.
template <class Shown, class Place>
class MeshChanges {
 public:
  static constexpr bool kTriangles = requires(const Shown& shown) { shown.all_triangles(); };
  static constexpr bool kTetrahedra = requires(const Shown& shown) { shown.all_tetrahedra(); };
  using Change = CellChange<kTetrahedra ? 4 : 3>;

  /// mirrored: place() turns triangles or tetrahedra over.
  MeshChanges(const Shown& shown, bool mirrored, Place place)
      : shown_(shown), mirrored_(mirrored), place_(std::move(place)) {}

  [[nodiscard]] Change of(const typename Shown::Changes& changes) const {
    Change change;
    for (const tri::VertexId v : changes.removed_vertices) {
      change.removed_vertices.push_back(number_of(v));
    }
    for (const tri::VertexId v : changes.added_vertices) add_vertex(change, v);
    if constexpr (kTriangles) {
      for (const auto t : changes.removed_triangles) change.removed_cells.push_back(number_of(t));
      for (const auto t : changes.added_triangles) add_cell(change, t);
    } else if constexpr (kTetrahedra) {
      for (const auto t : changes.removed_tetrahedra) change.removed_cells.push_back(number_of(t));
      for (const auto t : changes.added_tetrahedra) add_cell(change, t);
    }
    return change;
  }
  /// The same for a model, of which vertices may also change their points.
  [[nodiscard]] Change of(const typename tri::MultiresolutionModel<Shown>::Delta& delta) const {
    Change change = of(delta.changes);
    for (const tri::VertexId v : delta.reassigned) {
      change.moved_vertices.push_back(number_of(v));
      change.moved_positions.push_back(place_(v));
    }
    return change;
  }

  /// Returns all that is shown as a change that adds it.
  [[nodiscard]] Change snapshot() const {
    Change change;
    for (const tri::VertexId v : shown_.all_vertices()) add_vertex(change, v);
    if constexpr (kTriangles) {
      for (const auto t : shown_.all_triangles()) add_cell(change, t);
    } else if constexpr (kTetrahedra) {
      for (const auto t : shown_.all_tetrahedra()) add_cell(change, t);
    }
    return change;
  }

 private:
  void add_vertex(Change& change, tri::VertexId v) const {
    change.added_vertices.push_back(number_of(v));
    change.added_positions.push_back(place_(v));
  }
  template <class Cell>
  void add_cell(Change& change, Cell t) const {
    const auto vertices = shown_.vertices(t);
    auto& corners = change.added_corners.emplace_back();
    for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = number_of(vertices[i]);
    if (mirrored_) std::swap(corners[1], corners[2]);
    change.added_cells.push_back(number_of(t));
  }

  const Shown& shown_;
  bool mirrored_;
  Place place_;
};

}  // namespace terrace::python
