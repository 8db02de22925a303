// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include <terrace/stream/point.hpp>
#include <terrace/tri/multiresolution.hpp>
#include <terrace/tri/point_cloud.hpp>

#include "arrays.hpp"

namespace terrace::python {

/// Vertices and triangles added to and removed from a model of a store's points, as columns.
struct MeshChange {
  std::vector<std::int32_t> added_vertices, removed_vertices, moved_vertices;
  std::vector<stream::Point3> added_positions, moved_positions;
  std::vector<std::int32_t> added_triangles, removed_triangles;
  std::vector<std::array<std::int32_t, 3>> added_corners;
};

inline py::dict dict_of(MeshChange&& change) {
  py::dict result;
  result["added_vertices"] = to_array(std::move(change.added_vertices));
  result["added_positions"] = to_array(std::move(change.added_positions));
  result["removed_vertices"] = to_array(std::move(change.removed_vertices));
  result["moved_vertices"] = to_array(std::move(change.moved_vertices));
  result["moved_positions"] = to_array(std::move(change.moved_positions));
  result["added_triangles"] = to_array(std::move(change.added_triangles));
  result["added_corners"] = to_array(std::move(change.added_corners));
  result["removed_triangles"] = to_array(std::move(change.removed_triangles));
  return result;
}

template <class Id>
std::int32_t number_of(Id of) {
  return static_cast<std::int32_t>(tri::slot(of));
}

/// Collects the changes of a model. place(vertex) returns the position of a vertex.
template <class Shown, class Place>
class MeshChanges {
 public:
  static constexpr bool kTriangles = !std::is_same_v<Shown, tri::PointCloud>;
  using Model = tri::MultiresolutionModel<Shown>;

  MeshChanges(const Model& model, Place place) : model_(model), place_(std::move(place)) {}

  [[nodiscard]] MeshChange of(const typename Model::Delta& delta) const {
    MeshChange change;
    for (const tri::VertexId v : delta.changes.removed_vertices) {
      change.removed_vertices.push_back(number_of(v));
    }
    for (const tri::VertexId v : delta.changes.added_vertices) add(change, v);
    for (const tri::VertexId v : delta.reassigned) {
      change.moved_vertices.push_back(number_of(v));
      change.moved_positions.push_back(place_(v));
    }
    if constexpr (kTriangles) {
      for (const auto t : delta.changes.removed_triangles) {
        change.removed_triangles.push_back(number_of(t));
      }
      for (const auto t : delta.changes.added_triangles) add(change, t);
    }
    return change;
  }

  /// Returns the whole model as a change that adds it.
  [[nodiscard]] MeshChange snapshot() const {
    MeshChange change;
    for (const tri::VertexId v : model_.triangulation().all_vertices()) add(change, v);
    if constexpr (kTriangles) {
      for (const auto t : model_.triangulation().all_triangles()) add(change, t);
    }
    return change;
  }

 private:
  void add(MeshChange& change, tri::VertexId v) const {
    change.added_vertices.push_back(number_of(v));
    change.added_positions.push_back(place_(v));
  }
  void add(MeshChange& change, tri::TriangleId t) const {
    if constexpr (kTriangles) {
      const auto corners = model_.triangulation().vertices(t);
      change.added_triangles.push_back(number_of(t));
      change.added_corners.push_back(
          {number_of(corners[0]), number_of(corners[1]), number_of(corners[2])});
    }
  }

  const Model& model_;
  Place place_;
};

}  // namespace terrace::python
