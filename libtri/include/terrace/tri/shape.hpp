// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/tri/delaunay3.hpp"
#include "terrace/tri/metric.hpp"

/// Reconstructs the non-convex shape of points scanned from a surface: of the Delaunay tetrahedra,
/// which fill the convex hull, those inside the shape are kept, and their outer facets are the
/// surface. Either every tetrahedron is judged by the angles between circumspheres
/// (ShapeRule::kPoles), or those outside are peeled off, starting from the hull (J. Skala's thesis,
/// section 8.3).
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

/// For the two rules that peel: which facets of a tetrahedron are likely to lie on the surface
/// ("boundary" facets), as seen from that tetrahedron: those that are small compared to it.
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
  /// By the strongest evidence on which side of the surface a tetrahedron is, in three steps.
  ///
  /// 1. Two tetrahedra that share a facet are the more likely on the same side the more deeply
  /// their circumspheres cut each other: the defect of that statement is 1 - cos of the angle
  /// between the directions from a corner to their circumcentres. At a vertex the two poles, the
  /// largest circumspheres on opposite sides (N. Amenta, M. Bern, doi:10.1007/PL00009475), are on
  /// different sides: the defect is 2 (1 + cos) of the angle between the directions to them. The
  /// space beyond the hull takes part with half-spaces as spheres. A spanning forest of least
  /// defect connects all tetrahedra with that space, and tells the side of each.
  /// 2. Tetrahedra whose facets contradict that, with 2 - defect as weight, more than they support
  /// it change sides, the largest difference first, if two or more neighbours differ and no vertex
  /// thereby loses its last tetrahedron of a side.
  /// 3. At a vertex whose tetrahedra are all on one side, a tetrahedron whose facet opposite to the
  /// vertex is on the surface changes sides: the surface is drawn to the vertex. Its topology does
  /// not change.
  ///
  /// Ties are broken by the corners sorted by x, y, z. It knows angles, no lengths, so the samples'
  /// density may vary. Nearly every vertex ends on the surface; so it is for samples of surfaces,
  /// not of volumes, and outliers become spikes. An open surface is closed by lids, see
  /// BasicShape3::surface_without_lids().
  kPoles,
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
  ShapeRule rule = ShapeRule::kPoles;
  ShapeCriterion criterion = ShapeCriterion::kGabriel;  ///< of the rules that peel
  /// For ShapeCriterion::kEdgeLength; smaller values remove more. The thesis uses 0.5 with the
  /// published rule. The flood rule leaks through the first hole: with 0.5 it empties even a sphere
  /// of regular samples, which 1 restores.
  double edge_factor = 0.5;
  /// With the rules that peel, no vertex loses all of its tetrahedra. Published rule: a removal
  /// that would take a vertex's last one is skipped. Flood rule: after the flood tetrahedra are put
  /// back until every vertex has one: each time the one with the shortest longest edge (on ties the
  /// lexicographically first, corners sorted) among those that have a vertex without tetrahedra and
  /// share a facet with a kept one; if there are none of these, among all that have such a vertex.
  bool keep_vertices = true;
};

struct ShapeSurface {
  Surface surface;
  std::vector<VertexId> vertices;     ///< the vertex of each point of the surface; by slot
  std::vector<TetrahedronId> behind;  ///< the kept tetrahedron behind each face
  bool open = false;                  ///< lids were left out
  std::size_t lids = 0;               ///< of surface_without_lids(): how many, left out or not
};

/// What a surface consists of once it is taken apart where solids touch in an edge or a vertex.
struct ShapeParts {
  std::size_t components = 0;
  std::int64_t euler_characteristic = 0;  ///< each part's is 2 less twice its handles
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

  /// Computes the shape from scratch; the same for any number of threads, of which only the poles
  /// rule uses more than one (0: one per core). Poles: O(n log n). Flood: O(n) facet tests, about
  /// twice as many as removed tetrahedra, and O(m log m) for m tetrahedra at vertices that the
  /// flood has lost.
  /// After check_stop has thrown, the shape can only be restored or destroyed.
  void restore(const Triangulation& triangulation, unsigned threads = 1,
               const base::StopCheck& check_stop = {});

  /// Updates the shape after changes of the triangulation that this object was restored from (or
  /// from its initial, empty state): the same result as restore(), at a cost that depends on the
  /// changes. `changes` must hold all changes since the last call: everything that take_changes()
  /// gives after a journal was started before restore().
  ///
  /// Flood: every removed tetrahedron remembers the facet through which the flood came. Tetrahedra
  /// reached through one that is gone, directly or indirectly, are tested again. O(changes + tested
  /// again), O(m log m) as above, and a walk around the corners of facets that joined the hull.
  /// Poles and published rule: from scratch.
  void update(const Triangulation& triangulation, const typename Triangulation::Changes& changes);

  /// As update(), but by the poles rule at a cost that depends on the changes, for interaction. The
  /// first step is repeated for the new tetrahedra and their neighbours alone, the other two for
  /// those between their corners; all others keep their labels. That is exact unless the change
  /// decides about tetrahedra farther away, which happens in weakly determined pockets: restore()
  /// tells from time to time, or before saving. Other rules: update().
  void update_nearby(const Triangulation& triangulation,
                     const typename Triangulation::Changes& changes);

  /// Accepts any handle; false for those not in use.
  [[nodiscard]] bool kept(TetrahedronId tetrahedron) const;
  /// Number of kept tetrahedra. O(1).
  [[nodiscard]] std::size_t kept_count() const;
  /// Tetrahedra put back after the flood because of a vertex.
  [[nodiscard]] std::size_t rescued_count() const;
  /// By slot. Poles: vertices that are not on the surface. Other rules: vertices that the rule by
  /// itself leaves without a tetrahedron; with keep_vertices and the flood rule, those that were
  /// given one back. Empty while there are no tetrahedra.
  [[nodiscard]] std::vector<VertexId> lost_vertices() const;
  /// Kept tetrahedra by slot. O(slots).
  [[nodiscard]] std::vector<TetrahedronId> kept_tetrahedra() const;

  /// The facets between kept tetrahedra and the outside, counter-clockwise seen from outside. Every
  /// edge is in as many of them in one direction as in the other: the surface is closed. Where kept
  /// tetrahedra meet only in an edge, that edge is in four or more faces; where they meet only in a
  /// vertex, the surface touches itself there. Faces by slot of their tetrahedron. O(slots).
  [[nodiscard]] ShapeSurface surface(const Triangulation& triangulation) const;
  /// surface(), but of an open scan without its lids: the faces by which the poles rule closes what
  /// has not been scanned. A face is a lid if one of its edges is more than 10 times as long as the
  /// spacing at each of its corners, which is the third shortest edge of the triangulation there.
  /// If lids are more than a tenth of the area, the scan is open and they are left out; otherwise
  /// nothing is. Lengths and areas are those of the metric. O(slots).
  [[nodiscard]] ShapeSurface surface_without_lids(const Triangulation& triangulation) const;
  /// The parts of this shape's surface, with or without lids. Where four or more faces meet in an
  /// edge, those that bound the same inside are joined there, and only those; measure() joins all.
  /// O(slots).
  [[nodiscard]] ShapeParts parts(const Triangulation& triangulation,
                                 const ShapeSurface& surface) const;
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
  /// 0: one per core. The result is the same for any number.
  unsigned threads = 1;
  base::StopCheck check_stop = {};
};

struct RestoredSurface {
  Surface surface;
  /// The input index of each point of the surface.
  std::vector<std::size_t> input{};
  /// Points that are a corner of no face. A point that coincides with another counts with it.
  std::size_t points_off = 0;
  /// The scan is open, and the lids over what has not been scanned were left out (poles rule only),
  /// see BasicShape3::surface_without_lids().
  bool open = false;
  std::size_t lids = 0;  ///< how many lids were left out or, if it is not open, are faces
  ShapeParts parts{};    ///< see BasicShape3::parts()
};

/// The surface from which the points were scanned. No faces if all points (after any rounding) are
/// in one plane; duplicates do not matter. A function of the points, their order and the options.
///
/// Throws std::invalid_argument naming the index of a point that is not finite, or an option out of
/// range (including a metric together with rounding).
///
/// Cost: a triangulation and the shape, each 0.2 to 0.3 s per 100,000 points.
RestoredSurface restore_surface(std::span<const Point3> points, const RestoreOptions& options = {});

}  // namespace terrace::tri
