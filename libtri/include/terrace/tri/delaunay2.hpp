// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

/// Dynamic Delaunay triangulation of the plane: exact, canonical, compact.
///
/// The triangulation is a function of the point set alone. Ties of cocircular points are broken by
/// a symbolic perturbation: points are lifted to the paraboloid and raised infinitesimally, the
/// lexicographically larger (x, then y) infinitely more. Collapse after expand gives back the very
/// triangles, in any order of operations.

namespace terrace::tri {

/// 32-bit handles. A vertex handle stays valid until its vertex is removed, a triangle handle until
/// an operation removes the triangle; both numbers are then used again.
enum class VertexId : std::uint32_t {};
enum class TriangleId : std::uint32_t {};
inline constexpr VertexId kNoVertex{0xFFFFFFFFu};
inline constexpr TriangleId kNoTriangle{0xFFFFFFFFu};

/// Coord = std::int32_t: exact for coordinates of at most 30 bits (0 <= c < 2^30); integer
/// arithmetic only, the same on every machine.
/// Coord = double: any finite coordinates; exact predicates, no point is ever moved.
template <class Coord>
class Delaunay2 {
 public:
  using Point = std::array<Coord, 2>;

  Delaunay2();
  ~Delaunay2();
  Delaunay2(Delaunay2&&) noexcept;
  Delaunay2& operator=(Delaunay2&&) noexcept;

  struct Insertion {
    VertexId vertex;
    bool created;  ///< false: a vertex of equal coordinates was there and is `vertex`
  };

  /// Adds points to an empty triangulation, fast. Returns the vertex of each point, equal points
  /// the same. Throws: std::invalid_argument naming the index of a coordinate that is not finite or
  /// out of range; the object is then unchanged. O(n log n).
  std::vector<VertexId> build(std::span<const Point> points);
  /// Adds the complete grid x0, x0 + step, ... (columns x rows) to an empty triangulation; vertex
  /// of (i, j) is returned-first + j * columns + i.
  VertexId build_grid(Coord x0, Coord y0, Coord step, std::uint32_t columns, std::uint32_t rows);
  /// hint: a vertex near the point, for the walk; kNoVertex: the last one used.
  Insertion insert(const Point& point, VertexId hint = kNoVertex);
  void insert(std::span<const Point> points, std::span<Insertion> results,
              VertexId hint = kNoVertex);
  void remove(VertexId vertex);
  /// Removes a set (all different) by enlarging one hole, thesis 8.1; much faster than one by one
  /// when the set is compact.
  void remove(std::span<const VertexId> vertices);

  [[nodiscard]] std::size_t vertex_count() const;
  /// Finite triangles. 0 while all points are collinear.
  [[nodiscard]] std::size_t triangle_count() const;
  [[nodiscard]] Point point(VertexId vertex) const;
  [[nodiscard]] std::array<VertexId, 3> vertices(TriangleId triangle) const;  ///< counter-clockwise
  /// Neighbour opposite to vertices()[i]; kNoTriangle beyond the hull.
  [[nodiscard]] std::array<TriangleId, 3> neighbours(TriangleId triangle) const;

  // More of the public surface (locate, nearest, iteration, change observation, memory) is to be
  // added by the owner of this header.

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::tri
