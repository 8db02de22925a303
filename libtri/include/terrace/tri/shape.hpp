// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "terrace/tri/delaunay3.hpp"
#include "terrace/tri/metric.hpp"

/// Reconstructs the non-convex shape of points scanned from a surface: from the Delaunay
/// tetrahedra, which fill the convex hull, those outside the shape are peeled off, starting from
/// the hull (J. Skala's thesis, section 8.3). The remaining tetrahedra are the inside, their outer
/// facets the surface.
///
/// restore_surface() goes from points to a surface in one call. BasicShape3 follows a changing
/// triangulation. measure() takes surfaces of any origin.

namespace terrace::tri {

struct Surface {
  std::vector<Point3> points;
  /// Point indices, counter-clockwise seen from outside.
  std::vector<std::array<std::uint32_t, 3>> faces;
};

struct SurfaceMeasures {
  std::size_t faces = 0;
  std::size_t vertices = 0;  ///< points used by a face
  std::size_t edges = 0;
  double area = 0.0;
  /// The enclosed volume, by the divergence theorem; if the surface is not closed it depends on
  /// where the openings are.
  double volume = 0.0;
  /// Sets of faces connected by edges.
  std::size_t components = 0;
  /// vertices - edges + faces. 2 for a sphere, 2 - 2g for a closed surface with g handles; each
  /// vertex or edge where a surface touches itself lowers it.
  std::int64_t euler_characteristic = 0;
  std::size_t border_edges = 0;        ///< in one face only
  std::size_t non_manifold_edges = 0;  ///< in three or more faces
  /// Every edge is in as many faces in one direction as in the other.
  bool closed = true;
};

/// O(n log n). Sums are in the order of the faces. Throws std::invalid_argument naming a face with
/// a corner that is not a point's index, or with two equal corners.
SurfaceMeasures measure(const Surface& surface);

/// Turns components (faces connected by edges) with negative volume inside out. The volume of a
/// component that is not closed is measured from its first corner. O(n log n). Throws as measure().
void turn_outward(Surface& surface);

/// Which facets of a tetrahedron are likely to lie on the surface ("boundary" facets), as seen from
/// that tetrahedron: those that are small compared to it.
enum class ShapeCriterion : std::uint8_t {
  /// The interior of the smallest sphere that contains the facet does not contain the tetrahedron's
  /// fourth corner (K. Gabriel, R. Sokal, doi:10.2307/2412323). Two corners of the facet lie on
  /// that sphere if the third sees them at an obtuse angle, otherwise all three. Exact.
  kGabriel,
  /// The facet's perimeter is below edge_factor times the sum of the other three edges. In doubles,
  /// the same for the same points.
  kEdgeLength,
};

enum class ShapeRule : std::uint8_t {
  /// A tetrahedron beyond an open facet is removed as soon as that facet is not a boundary facet as
  /// seen from it. Open facets are those of the hull and of removed tetrahedra. So the removed
  /// tetrahedra are those reachable from outside: a function of the tetrahedra alone. Between
  /// surfaces that face each other across a gap or around a hole, a few tetrahedra whose facets are
  /// all boundary facets may stay.
  kFlood,
  /// As published: a tetrahedron with open facets is removed only if none of them is a boundary
  /// facet. The result depends on the order; here it goes in rounds (the neighbours of the
  /// tetrahedra removed in one round are next), within a round lexicographically by the corners
  /// sorted by x, y, z. It leaves slivers everywhere; for comparison.
  kPublished,
};

struct ShapeOptions {
  ShapeCriterion criterion = ShapeCriterion::kGabriel;
  ShapeRule rule = ShapeRule::kFlood;
  /// For ShapeCriterion::kEdgeLength; smaller values remove more. The thesis uses 0.5 with the
  /// published rule. The flood rule leaks through the first hole: with 0.5 it empties even a sphere
  /// of regular samples, which 1 restores.
  double edge_factor = 0.5;
  /// No vertex loses all of its tetrahedra. Published rule: a removal that would take a vertex's
  /// last one is skipped. Flood rule: after the flood tetrahedra are put back until every vertex
  /// has one: each time the one with the shortest longest edge (on ties the lexicographically
  /// first, corners sorted) among those that have a vertex without tetrahedra and share a facet
  /// with a kept one; if there are none of these, among all that have such a vertex.
  bool keep_vertices = true;
};

struct ShapeSurface {
  Surface surface;
  std::vector<VertexId> vertices;  ///< the vertex of each point of the surface; by slot
};

/// The kept tetrahedra of a triangulation, computed from scratch or kept up to date with its
/// changes. A function of the point set and the options, whatever the history of the triangulation
/// and of this object.
///
/// One byte per tetrahedron slot and four per vertex slot. Triangulation: any Delaunay3; see
/// Shape3 below.
///
/// In an elliptical metric the tetrahedra are those of the metric, smallest spheres are its
/// smallest ellipsoids (exact), and edge lengths, both for ShapeCriterion::kEdgeLength and for
/// choosing the tetrahedra to put back, are its lengths (in doubles, of differences mapped by the
/// triangulation's map). So it is the shape of the mapped points: samples that are denser across
/// the long axes than along them are as good as uniform ones.
template <class Triangulation>
class BasicShape3 {
 public:
  /// Throws std::invalid_argument if edge_factor is not a positive finite number.
  explicit BasicShape3(const ShapeOptions& options = {});
  ~BasicShape3();
  /// A moved-from shape can only be destroyed or assigned to.
  BasicShape3(BasicShape3&&) noexcept;
  BasicShape3& operator=(BasicShape3&&) noexcept;

  /// Computes the shape from scratch. Flood: O(n) facet tests, about twice as many as removed
  /// tetrahedra, and O(m log m) for m tetrahedra at vertices that the flood has lost.
  void restore(const Triangulation& triangulation);

  /// Updates the shape after changes of the triangulation that this object was restored from (or
  /// from its initial, empty state): the same result as restore(), at a cost that depends on the
  /// changes. `changes` must hold all changes since the last call: everything that take_changes()
  /// gives after a journal was started before restore().
  ///
  /// Flood: every removed tetrahedron remembers the facet through which the flood came. Tetrahedra
  /// reached through one that is gone, directly or indirectly, are tested again. O(changes + tested
  /// again), O(m log m) as above, and a walk around the corners of facets that joined the hull.
  /// Published rule: from scratch, as it is not local.
  void update(const Triangulation& triangulation, const typename Triangulation::Changes& changes);

  /// Accepts any handle; false for those not in use.
  [[nodiscard]] bool kept(TetrahedronId tetrahedron) const;
  /// Number of kept tetrahedra. O(1).
  [[nodiscard]] std::size_t kept_count() const;
  /// Tetrahedra put back after the flood because of a vertex.
  [[nodiscard]] std::size_t rescued_count() const;
  /// Vertices that the rule by itself leaves without a tetrahedron, by slot: with keep_vertices and
  /// the flood rule, those that were given one back. Empty while there are no tetrahedra.
  [[nodiscard]] std::vector<VertexId> lost_vertices() const;
  /// Kept tetrahedra by slot. O(slots).
  [[nodiscard]] std::vector<TetrahedronId> kept_tetrahedra() const;

  /// The facets between kept tetrahedra and the outside, counter-clockwise seen from outside. Every
  /// edge is in as many of them in one direction as in the other: the surface is closed. Where kept
  /// tetrahedra meet only in an edge, that edge is in four or more faces; where they meet only in a
  /// vertex, the surface touches itself there. Faces by slot of their tetrahedron. O(slots).
  [[nodiscard]] ShapeSurface surface(const Triangulation& triangulation) const;
  /// Sum of the volumes of the kept tetrahedra. O(slots).
  [[nodiscard]] double volume(const Triangulation& triangulation) const;

  [[nodiscard]] const ShapeOptions& options() const;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

template <class Coord, class Metric = Euclidean>
using Shape3 = BasicShape3<Delaunay3<Coord, Metric>>;

extern template class BasicShape3<Delaunay3<std::int32_t>>;
extern template class BasicShape3<Delaunay3<double>>;
extern template class BasicShape3<Delaunay3<double, EllipticalMetric3>>;

struct RestoreOptions {
  ShapeOptions shape;
  /// 0 triangulates the points unchanged. 1 to 30: the points are rounded to integers of this many
  /// bits over the longest side of their bounding box, which is faster; 24 is finer than a float.
  /// The first of several points that coincide after rounding represents them. The surface has the
  /// given coordinates in any case.
  unsigned quantise_bits = 0;
  /// An elliptical metric in which the points are triangulated and the facets classified, see
  /// BasicShape3. Not together with quantise_bits.
  std::optional<EllipticalMetric3> metric;
};

struct RestoredSurface {
  Surface surface;
  /// The input index of each point of the surface.
  std::vector<std::size_t> input;
};

/// The surface from which the points were scanned. No faces if all points (after any rounding) are
/// in one plane; duplicates do not matter. A function of the points, their order and the options.
///
/// Throws std::invalid_argument naming the index of a point that is not finite, or an option out of
/// range (including a metric together with rounding).
///
/// Cost: a triangulation and a flood, 0.1 to 0.3 s per 100,000 points.
RestoredSurface restore_surface(std::span<const Point3> points, const RestoreOptions& options = {});

}  // namespace terrace::tri
