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

/// The surface that a changing set of points was scanned from: their tetrahedra and those of them
/// inside the shape (ShapeRule::kPoles), read like a Delaunay2, whose triangles are here the facets
/// of the surface. In a multiresolution model, and under the control of a view, it takes the place
/// of a triangulation.
///
/// Points come and go at once; the surface follows in follow(), by the rules of
/// BasicShape3::update_nearby(): new tetrahedra are judged, with those around them, all others stay
/// as they were. So the tetrahedra are a function of the points alone, but the surface may depend
/// in a few pockets on how they came; restore() computes it from scratch.
///
/// It is closed, turned outward, and touches itself where kept tetrahedra meet in an edge or a
/// vertex, see BasicShape3::surface(). Of an open scan the lids are left out, by the rule of
/// BasicShape3::surface_without_lids(), and no triangles: open() tells. Whether a facet is a lid is
/// looked at again where tetrahedra have been exchanged, and sums of areas are exact; so both are
/// functions of the facets and the points. Handles of vertices are those of Delaunay3; a triangle
/// has a handle as long as it is on the surface, even if the tetrahedron behind it is replaced.
///
/// Coord: as in Delaunay3. Memory: 390 bytes per vertex, most of it for the tetrahedra.
template <class Coord>
class DynamicSurface {
 public:
  using Point = std::array<Coord, 3>;
  using Insertion = typename Delaunay3<Coord>::Insertion;

  /// The net difference between two moments, as in Delaunay2. Vertices are those of the
  /// tetrahedra; nearly all of them are on the surface.
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

  /// As in Delaunay3; the surface of these points is there at once.
  std::vector<VertexId> build(std::span<const Point> points);
  /// As in Delaunay3. Until follow() the surface is that of before, and its triangles may have
  /// corners that are gone.
  void insert(std::span<const Point> points, std::span<Insertion> results,
              VertexId hint = kNoVertex);
  void remove(std::span<const VertexId> vertices);
  /// An estimate of the work of removing these and following: as much as for this many points in an
  /// ordinary place. Where detail ends, points have tetrahedra with thousands of the fine ones on
  /// the other side of a body. As of the last follow(). O(vertices).
  [[nodiscard]] std::size_t removal_work(std::span<const VertexId> vertices) const;
  void reserve(std::size_t vertices);
  /// Sets what building, inserting and restoring call at intervals. After it has thrown, the object
  /// can only be destroyed.
  void set_check_stop(base::StopCheck check_stop);

  /// Brings the surface up to date. About 16 us per point that came or went; from scratch if most
  /// tetrahedra are new.
  void follow();
  /// Computes the surface from scratch, 3 us per vertex. The result is that of a new object of the
  /// same points. threads: 0 is one per core; the result is the same for any number.
  void restore(unsigned threads = 1);

  /// Starts recording and drops earlier records.
  void start_journal();
  /// Brings the surface up to date, and tells the changes since start_journal() or the last call.
  /// Apply removals first: a reused handle is on both sides. Requires a started journal.
  void take_changes(Changes& changes);

  [[nodiscard]] std::size_t vertex_count() const;
  [[nodiscard]] std::size_t triangle_count() const;
  /// Whether the scan is open, and lids are left out. O(1).
  [[nodiscard]] bool open() const;
  [[nodiscard]] Point point(VertexId vertex) const;
  /// Counter-clockwise seen from outside, the smallest handle first.
  [[nodiscard]] std::array<VertexId, 3> vertices(TriangleId triangle) const;
  /// How many triangles have this corner; none if the vertex is not on the surface. O(1).
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
  /// Equal for equal sets of triangles by coordinates, whatever their history. O(n).
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
