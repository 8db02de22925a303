// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/shape.hpp"
#include "terrace/tri/vertex_tree.hpp"

namespace terrace::tri {

/// The surface of a cut of a vertex tree (vertex_tree.hpp) that changes vertex by vertex. It equals
/// surface_of_cut() of the same active vertices, whatever came before.
///
/// A triangle of the full surface appears when its corners get three different nearest active
/// ancestors, with these as corners, and disappears when two of them become equal. Source: D.
/// Luebke, C. Erikson, "View-dependent simplification of arbitrary polygonal environments",
/// SIGGRAPH 1997; here vertices become active one at a time, not with all of their siblings.
///
/// Vertices are numbered so that each comes before its descendants, which are consecutive; handles
/// are these numbers. A triangle keeps its handle while it exists, even if its corners change.
///
/// Memory: about 90 bytes per vertex of the full surface and 50 per triangle that exists.
class SurfaceFront {
 public:
  using Point = Point3;

  /// The net difference between two moments. A triangle whose corners changed is on both sides.
  struct Changes {
    std::vector<VertexId> removed_vertices;
    std::vector<Point> removed_points;
    std::vector<VertexId> added_vertices;
    std::vector<TriangleId> removed_triangles;
    std::vector<std::array<VertexId, 3>> removed_corners;  ///< of removed_triangles, in parallel
    std::vector<TriangleId> added_triangles;
    void clear();
  };

  /// Starts with the vertices that are in every cut. Throws: std::invalid_argument if the tree is
  /// not one of the surface's vertices. O(n times the depth at which neighbours part).
  SurfaceFront(const Surface& surface, const VertexTree& tree);
  ~SurfaceFront();
  /// A moved-from object can only be destroyed or assigned to.
  SurfaceFront(SurfaceFront&&) noexcept;
  SurfaceFront& operator=(SurfaceFront&&) noexcept;

  // ---- The tree -------------------------------------------------------------------------------

  /// Number of vertices of the full surface. Handles are 0 .. size() - 1.
  [[nodiscard]] std::size_t size() const;
  /// The index in the full surface of each vertex.
  [[nodiscard]] std::span<const std::uint32_t> input() const;
  /// kNoVertex for vertices that are in every cut.
  [[nodiscard]] VertexId parent(VertexId vertex) const;
  /// One more than the last descendant's number, or than the vertex's own if it has none.
  [[nodiscard]] std::uint32_t end_of_descendants(VertexId vertex) const;

  // ---- The cut --------------------------------------------------------------------------------

  /// Requires an inactive vertex with an active parent. O(triangles at both, and the depth of the
  /// tree for each that appears).
  void activate(VertexId vertex);
  /// Requires an active vertex that has a parent and no active descendants. The exact inverse.
  void deactivate(VertexId vertex);
  [[nodiscard]] bool alive(VertexId vertex) const;

  // ---- Reading --------------------------------------------------------------------------------
  // As in DynamicSurface.

  [[nodiscard]] std::size_t vertex_count() const;
  [[nodiscard]] std::size_t triangle_count() const;
  [[nodiscard]] const Point& point(VertexId vertex) const;
  [[nodiscard]] std::array<VertexId, 3> vertices(TriangleId triangle) const;
  /// Number of triangles with this corner. O(their number).
  [[nodiscard]] std::size_t triangles_at(VertexId vertex) const;
  [[nodiscard]] std::uint32_t vertex_slots() const;
  [[nodiscard]] std::uint32_t triangle_slots() const;
  [[nodiscard]] bool alive(TriangleId triangle) const;
  [[nodiscard]] AliveRange<SurfaceFront, VertexId> all_vertices() const {
    return {*this, vertex_slots()};
  }
  [[nodiscard]] AliveRange<SurfaceFront, TriangleId> all_triangles() const {
    return {*this, triangle_slots()};
  }
  /// A hash of the set of triangles by coordinates, whatever their history. O(triangles).
  [[nodiscard]] std::uint64_t hash() const;
  [[nodiscard]] std::size_t memory_bytes() const;

  /// Starts recording and drops earlier records.
  void start_journal();
  /// Replaces `changes` with the changes since start_journal() or the last call. Apply removals
  /// first. Requires a started journal.
  void take_changes(Changes& changes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::tri
