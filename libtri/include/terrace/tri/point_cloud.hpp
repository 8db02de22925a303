// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "terrace/tri/delaunay2.hpp"

namespace terrace::tri {

/// Points in space without connections. Replaces the triangulation in a multiresolution model that
/// needs only the points, such as a laser cloud on a screen. Equal points are separate vertices.
/// About 30 bytes per point.
///
/// Handles are as in Delaunay2. Members of the same name do the same.
class PointCloud {
 public:
  using Point = Point3;
  struct Insertion {
    VertexId vertex = kNoVertex;
    bool created = false;  ///< always true once inserted
  };
  struct Changes {
    std::vector<VertexId> removed_vertices;
    std::vector<Point> removed_points;
    std::vector<VertexId> added_vertices;
    void clear();
  };

  PointCloud();
  ~PointCloud();
  PointCloud(PointCloud&&) noexcept;
  PointCloud& operator=(PointCloud&&) noexcept;

  /// build() and insert() throw std::invalid_argument, naming the index, if a coordinate is not
  /// finite, and std::length_error beyond 2^29 - 2 points. The object is then unchanged.
  std::vector<VertexId> build(std::span<const Point> points);
  void insert(std::span<const Point> points, std::span<Insertion> results,
              VertexId hint = kNoVertex);
  void remove(std::span<const VertexId> vertices);
  void reserve(std::size_t vertices);

  [[nodiscard]] std::size_t vertex_count() const;
  [[nodiscard]] Point point(VertexId vertex) const;
  [[nodiscard]] std::uint32_t vertex_slots() const;
  [[nodiscard]] bool alive(VertexId vertex) const;
  [[nodiscard]] AliveRange<PointCloud, VertexId> all_vertices() const {
    return {*this, vertex_slots()};
  }
  /// A hash that is the same for equal sets of points, whatever their history. O(n).
  [[nodiscard]] std::uint64_t hash() const;
  [[nodiscard]] std::size_t memory_bytes() const;

  void start_journal();
  /// A point that was added and removed between two calls is in neither list. A reused slot is in
  /// both.
  void take_changes(Changes& changes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::tri
