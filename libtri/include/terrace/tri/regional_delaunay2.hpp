// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/tri/metric.hpp"

namespace terrace::tri {

/// The triangles of a changing set of points in a field of metrics. They are those of
/// metric_triangles(), with all its guarantees, are kept up to date as points come and go, and are
/// read like a Delaunay2. It takes the place of a triangulation in a multiresolution model and in a
/// view control:
///
///   MultiresolutionModel<RegionalDelaunay2<double>> model(source, {}, {}, field);
///
/// Points are inserted into and removed from the Euclidean triangulation, plain(), immediately.
/// follow() then updates the triangles. They are a function of the points and the field alone,
/// whatever the history.
///
/// follow() works as follows. Where plain() loses triangles, the triangles over them are flipped
/// back to those of plain(), exchanged, and flipped as the metric of their region requires. It
/// examines only the surroundings of a change. Flips are few unless ellipses are extreme.
///
/// Vertex handles are those of plain(). A triangle that exists before and after a call of follow()
/// keeps its handle. Triangle handles differ from those of plain(). Memory: 90 bytes per vertex
/// besides plain().
///
/// Coord: as in Delaunay2.
template <class Coord>
class RegionalDelaunay2 {
 public:
  using Point = std::array<Coord, 2>;
  using Insertion = typename Delaunay2<Coord>::Insertion;
  using Changes = typename Delaunay2<Coord>::Changes;

  /// Not explicit, so that a field converts to an empty triangulation. Euclidean without a field.
  RegionalDelaunay2(MetricField2 field = MetricField2(std::vector<MetricField2::Region>{}));
  ~RegionalDelaunay2();
  /// A moved-from triangulation can only be destroyed or assigned to.
  RegionalDelaunay2(RegionalDelaunay2&&) noexcept;
  RegionalDelaunay2& operator=(RegionalDelaunay2&&) noexcept;

  /// As in Delaunay2. The triangles are up to date on return. build() and insert() also throw
  /// std::invalid_argument if the field returns a map at a point that is not a metric, and whatever
  /// the field throws. The object is then unchanged. The field is evaluated once per point.
  std::vector<VertexId> build(std::span<const Point> points);
  /// As in Delaunay2. Until follow() is called the triangles stay as they were, and may have
  /// corners that no longer exist.
  void insert(std::span<const Point> points, std::span<Insertion> results,
              VertexId hint = kNoVertex);
  void remove(std::span<const VertexId> vertices);
  void reserve(std::size_t vertices);
  /// As in Delaunay2; also called during flips.
  void set_check_stop(base::StopCheck check_stop);

  /// Brings the triangles up to date. O(triangles around the change) plus the flips.
  void follow();

  /// Starts recording and drops earlier records.
  void start_journal();
  /// Brings the triangles up to date and replaces `changes` with the changes since start_journal()
  /// or the last call, see Delaunay2. Requires a started journal.
  void take_changes(Changes& changes);

  [[nodiscard]] std::size_t vertex_count() const;
  [[nodiscard]] std::size_t triangle_count() const;
  [[nodiscard]] Point point(VertexId vertex) const;
  /// The corners counter-clockwise, starting with the smallest handle.
  [[nodiscard]] std::array<VertexId, 3> vertices(TriangleId triangle) const;

  [[nodiscard]] std::uint32_t vertex_slots() const;
  [[nodiscard]] std::uint32_t triangle_slots() const;
  [[nodiscard]] bool alive(VertexId vertex) const;
  [[nodiscard]] bool alive(TriangleId triangle) const;
  [[nodiscard]] AliveRange<RegionalDelaunay2, VertexId> all_vertices() const {
    return {*this, vertex_slots()};
  }
  [[nodiscard]] AliveRange<RegionalDelaunay2, TriangleId> all_triangles() const {
    return {*this, triangle_slots()};
  }

  [[nodiscard]] const Delaunay2<Coord>& plain() const;
  [[nodiscard]] const MetricField2& field() const;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

extern template class RegionalDelaunay2<std::int32_t>;
extern template class RegionalDelaunay2<double>;

}  // namespace terrace::tri
