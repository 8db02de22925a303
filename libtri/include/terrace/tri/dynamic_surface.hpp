// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/tri/delaunay3.hpp"

namespace terrace::tri {

/// The surface from which a changing set of points was scanned. It holds the tetrahedra of the
/// points, and which of them are inside the shape (ShapeRule::poles). It is read like a Delaunay2:
/// its "triangles" are the facets of the surface. It takes the place of a triangulation in a
/// multiresolution model and in a view control.
///
/// Points are inserted and removed immediately. follow() then updates the surface by the rules of
/// BasicShape3::update_nearby(): it judges new tetrahedra and those around them, and leaves all
/// others as they were. The tetrahedra are a function of the points alone, but in a few pockets the
/// surface may depend on the order in which the points came. restore() computes it from scratch.
///
/// The surface is oriented outward. It touches itself where kept tetrahedra meet in an edge or a
/// vertex, see BasicShape3::surface(). It is closed, except for an open scan, which open() reports:
/// its lids are left out by the rule of BasicShape3::surface_without_lids(). Facets are
/// checked for lids again wherever tetrahedra were exchanged, and sums of areas are exact, so both
/// the lids and open() are functions of the facets and the points. Vertex handles are those of
/// Delaunay3. A triangle keeps its handle as long as it is on the surface, even if the tetrahedron
/// behind it is replaced.
///
/// Coord: as in Delaunay3. Memory: 390 bytes per vertex, mostly for the tetrahedra.
template <class Coord>
class DynamicSurface {
 public:
  using Point = std::array<Coord, 3>;
  using Insertion = typename Delaunay3<Coord>::Insertion;

  /// The net difference between two moments, as in Delaunay2. The vertices are those of the
  /// tetrahedra, nearly all of which are on the surface.
  struct Changes {
    std::vector<VertexId> removed_vertices;
    std::vector<Point> removed_points;
    std::vector<VertexId> added_vertices;
    std::vector<TriangleId> removed_triangles;
    std::vector<std::array<VertexId, 3>> removed_corners;  ///< of removed_triangles, in parallel
    std::vector<TriangleId> added_triangles;
    void clear();
  };

  DynamicSurface();
  ~DynamicSurface();
  /// A moved-from surface can only be destroyed or assigned to.
  DynamicSurface(DynamicSurface&&) noexcept;
  DynamicSurface& operator=(DynamicSurface&&) noexcept;

  /// As in Delaunay3. The surface is up to date on return.
  std::vector<VertexId> build(std::span<const Point> points);
  /// As in Delaunay3. Until follow() is called the surface stays as it was, and its triangles may
  /// have corners that no longer exist.
  void insert(std::span<const Point> points, std::span<Insertion> results,
              VertexId hint = kNoVertex);
  void remove(std::span<const VertexId> vertices);
  /// An estimate of the work of removing these vertices and following, as a number of points that
  /// would take as much work in an ordinary place. Where fine detail ends, points have tetrahedra
  /// with thousands of the fine points on the other side of a body. Based on the state at the last
  /// follow(). O(vertices).
  [[nodiscard]] std::size_t removal_work(std::span<const VertexId> vertices) const;
  void reserve(std::size_t vertices);
  /// Sets what building, inserting, removing and restoring call at intervals. After it has thrown,
  /// the object can only be destroyed.
  void set_check_stop(base::StopCheck check_stop);

  /// Brings the surface up to date, in about 16 us per point inserted or removed. Starts from
  /// scratch if most tetrahedra are new.
  void follow();
  /// Computes the surface from scratch, in 3 us per vertex. The result equals a new object with the
  /// same points. threads: 0 for one per core. The result does not depend on it.
  void restore(unsigned threads = 1);

  /// Starts recording and drops earlier records.
  void start_journal();
  /// Brings the surface up to date and replaces `changes` with the changes since start_journal() or
  /// the last call. Apply removals first, as a reused handle is on both sides. Requires a started
  /// journal.
  void take_changes(Changes& changes);

  [[nodiscard]] std::size_t vertex_count() const;
  [[nodiscard]] std::size_t triangle_count() const;
  /// Returns true if the scan is open, so that lids are left out. O(1).
  [[nodiscard]] bool open() const;
  [[nodiscard]] Point point(VertexId vertex) const;
  /// The corners counter-clockwise seen from outside, starting with the smallest handle.
  [[nodiscard]] std::array<VertexId, 3> vertices(TriangleId triangle) const;
  /// Number of triangles with this corner, 0 if the vertex is not on the surface. O(1).
  [[nodiscard]] std::size_t triangles_at(VertexId vertex) const;

  [[nodiscard]] std::uint32_t vertex_slots() const;
  [[nodiscard]] std::uint32_t triangle_slots() const;
  [[nodiscard]] bool alive(VertexId vertex) const;
  [[nodiscard]] bool alive(TriangleId triangle) const;
  [[nodiscard]] AliveRange<DynamicSurface, VertexId> all_vertices() const {
    return {*this, vertex_slots()};
  }
  [[nodiscard]] AliveRange<DynamicSurface, TriangleId> all_triangles() const {
    return {*this, triangle_slots()};
  }

  [[nodiscard]] const Delaunay3<Coord>& tetrahedra() const;
  /// A hash of the set of triangles by coordinates, whatever their history. O(n).
  [[nodiscard]] std::uint64_t hash() const;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

template <class Coord>
void DynamicSurface<Coord>::Changes::clear() {
  removed_vertices.clear();
  removed_points.clear();
  added_vertices.clear();
  removed_triangles.clear();
  removed_corners.clear();
  added_triangles.clear();
}

extern template class DynamicSurface<std::int32_t>;
extern template class DynamicSurface<double>;

}  // namespace terrace::tri
