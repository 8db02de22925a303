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

/// Reconstructs the non-convex shape of points scanned from a surface. Delaunay tetrahedra fill the
/// convex hull. Those inside the shape are kept, and their outer facets are the surface. Either the
/// angles between circumspheres decide about every tetrahedron (ShapeRule::poles), or the
/// tetrahedra outside are peeled off, starting from the hull (J. Skala's thesis, section 8.3).
///
/// restore_surface() goes from points to a surface in one call. BasicShape3 follows a changing
/// triangulation. measure() accepts surfaces of any origin.

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
  /// The enclosed volume, by the divergence theorem. If the surface is not closed it depends on
  /// where the openings are.
  double volume = 0.0;
  /// Number of sets of faces connected by edges.
  std::size_t components = 0;
  /// vertices - edges + faces: 2 for a sphere, 2 - 2g for a closed surface with g handles. Each
  /// vertex or edge where a surface touches itself lowers it.
  std::int64_t euler_characteristic = 0;
  std::size_t border_edges = 0;        ///< in one face only
  std::size_t non_manifold_edges = 0;  ///< in three or more faces
  /// True if every edge is in as many faces in one direction as in the other.
  bool closed = true;
};

/// Measures a surface in O(n log n). Sums run in the order of the faces. Throws
/// std::invalid_argument naming a face with a corner that is not the index of a point, or with two
/// equal corners.
SurfaceMeasures measure(const Surface& surface);

/// Turns components (faces connected by edges) with negative volume inside out. The volume of a
/// component that is not closed is measured from its first corner. O(n log n). Throws as measure()
/// does.
void turn_outward(Surface& surface);

/// Returns a unit normal for each point of a surface, outward if the faces are oriented outward:
/// the sum of the unit normals of its faces, each times the face's angle at the point. Unlike a sum
/// by area it does not depend on how a flat part is cut into triangles (G. Thuermer, C. Wuethrich,
/// "Computing vertex normals from polygonal facets", doi:10.1080/10867651.1998.10487487). The
/// normal is zero for a point whose faces have no area or cancel out, or that has no face.
///
/// threads: 0 for one per core; the result does not depend on it. Throws std::invalid_argument
/// naming a point that is not finite or a face with a corner that is not the index of a point.
/// O(faces).
[[nodiscard]] std::vector<Point3> vertex_normals(const Surface& surface, unsigned threads = 1);

/// Decides which facets of a tetrahedron are likely to be on the surface ("boundary" facets) as
/// seen from that tetrahedron: those that are small compared to it. Used by the two rules that
/// peel.
enum class ShapeCriterion : std::uint8_t {
  /// The interior of the smallest sphere that contains the facet does not contain the tetrahedron's
  /// fourth corner (K. Gabriel, R. Sokal, doi:10.2307/2412323). Two corners of the facet are on
  /// that sphere if the third sees them at an obtuse angle, otherwise all three. Exact.
  gabriel,
  /// The facet's perimeter is below edge_factor times the sum of the other three edges. Computed in
  /// doubles, with the same result for the same points.
  edge_length,
};

enum class ShapeRule : std::uint8_t {
  /// Decides by the strongest evidence on which side of the surface a tetrahedron is, in three
  /// steps.
  ///
  /// 1. Two tetrahedra that share a facet are the more likely to be on the same side the more
  /// deeply their circumspheres overlap. The defect of the statement "on the same side" is 1 - cos
  /// of the angle between the directions from a corner to their circumcentres. At a vertex the two
  /// poles, the largest circumspheres on opposite sides (N. Amenta, M. Bern,
  /// doi:10.1007/PL00009475), are on different sides. The defect of that statement is 2 (1 + cos)
  /// of the angle between the directions to them. The space beyond the hull takes part with
  /// half-spaces as spheres. A spanning forest of least defect connects all tetrahedra with that
  /// space and determines the side of each.
  ///
  /// 2. A tetrahedron changes sides if its facets contradict its side more than they support it,
  /// with 2 - defect as weight, if two or more neighbours differ, and if no vertex thereby loses
  /// its last tetrahedron of a side. The largest difference comes first.
  ///
  /// 3. At a vertex whose tetrahedra are all on one side, a tetrahedron whose facet opposite to the
  /// vertex is on the surface changes sides. This draws the surface to the vertex without changing
  /// its topology.
  ///
  /// The corners sorted by x, y, z break ties. The rule uses angles and no lengths, so the density
  /// of the samples may vary. Nearly every vertex ends on the surface, so the rule suits samples of
  /// surfaces but not of volumes, and outliers become spikes. Lids close an open surface, see
  /// BasicShape3::surface_without_lids().
  poles,
  /// Removes a tetrahedron beyond an open facet as soon as that facet is not a boundary facet as
  /// seen from it. Open facets are those of the hull and of removed tetrahedra. The removed
  /// tetrahedra are therefore those reachable from outside: a function of the tetrahedra alone.
  /// Between surfaces that face each other across a gap or around a hole, a few tetrahedra whose
  /// facets are all boundary facets may stay.
  flood,
  /// The rule as published: a tetrahedron with open facets is removed only if none of them is a
  /// boundary facet. The result depends on the order. Here it proceeds in rounds (the neighbours of
  /// the tetrahedra removed in one round come next), and within a round lexicographically by the
  /// corners sorted by x, y, z. It leaves slivers everywhere and is meant for comparison.
  published,
};

struct ShapeOptions {
  ShapeRule rule = ShapeRule::poles;
  ShapeCriterion criterion = ShapeCriterion::gabriel;  ///< for the rules that peel
  /// For ShapeCriterion::edge_length. Smaller values remove more. The thesis uses 0.5 with the
  /// published rule. The flood rule leaks through the first hole: with 0.5 it empties even a sphere
  /// of regular samples, which it restores with 1.
  double edge_factor = 0.5;
  /// Prevents the rules that peel from taking all tetrahedra of a vertex. The published rule skips
  /// a removal that would take a vertex's last tetrahedron. After the flood rule, tetrahedra are
  /// put back until every vertex has one. Each time the candidate with the shortest longest edge is
  /// put back (on ties the lexicographically first, corners sorted). Candidates have a vertex
  /// without tetrahedra and share a facet with a kept tetrahedron. If there are none, sharing a
  /// facet is not required.
  bool keep_vertices = true;
};

struct ShapeSurface {
  Surface surface;
  std::vector<VertexId> vertices;  ///< the vertex of each point of the surface, sorted by slot
  std::vector<TetrahedronId> tetrahedra;  ///< the kept tetrahedron behind each face
  bool open = false;                      ///< lids were left out
  std::size_t lids = 0;                   ///< number found by surface_without_lids()
};

/// The parts of a surface after separating it where solids touch in an edge or a vertex.
struct ShapeParts {
  std::size_t components = 0;
  std::int64_t euler_characteristic = 0;  ///< sum over the parts, each 2 minus twice its handles
};

/// The kept tetrahedra of a triangulation, computed from scratch or kept up to date with its
/// changes. They are a function of the point set and the options, whatever the history of the
/// triangulation and of this object.
///
/// Needs one byte per tetrahedron slot and four per vertex slot. Triangulation: any Delaunay3. See
/// Shape3 below.
///
/// In an elliptical metric the tetrahedra are those of the metric, and smallest spheres are its
/// smallest ellipsoids (exact). Edge lengths, used by ShapeCriterion::edge_length and to choose the
/// tetrahedra to put back, are its lengths (in doubles, of differences mapped by the
/// triangulation's map). The result is the shape of the mapped points, so samples that are denser
/// across the long axes than along them work as well as uniform ones.
template <class Triangulation>
class BasicShape3 {
 public:
  /// Throws std::invalid_argument if edge_factor is not a positive finite number.
  explicit BasicShape3(const ShapeOptions& options = {});
  ~BasicShape3();
  /// A moved-from shape can only be destroyed or assigned to.
  BasicShape3(BasicShape3&&) noexcept;
  BasicShape3& operator=(BasicShape3&&) noexcept;

  /// Computes the shape from scratch. The result does not depend on the number of threads (0: one
  /// per core). Only the poles rule uses more than one. Poles: O(n log n). Flood: O(n) facet tests,
  /// about twice as many as removed tetrahedra, and O(m log m) for m tetrahedra at vertices that
  /// the flood has lost.
  /// After check_stop has thrown, the shape can only be restored or destroyed.
  void restore(const Triangulation& triangulation, unsigned threads = 1,
               const base::StopCheck& check_stop = {});

  /// Updates the shape after changes of the triangulation from which this object was restored (or
  /// from its initial, empty state). Gives the same result as restore(), at a cost that depends on
  /// the changes. `changes` must hold all changes since the last call: everything that
  /// take_changes() returns after a journal was started before restore().
  ///
  /// Flood: every removed tetrahedron remembers the facet through which the flood came. Tetrahedra
  /// reached directly or indirectly through one that no longer exists are tested again. O(changes +
  /// tested again), O(m log m) as above, and a walk around the corners of facets that joined the
  /// hull. Poles and published rule: from scratch.
  void update(const Triangulation& triangulation, const typename Triangulation::Changes& changes);

  /// Like update(), but applies the poles rule at a cost that depends on the changes, for
  /// interactive use. It repeats the first step only for the new tetrahedra and their neighbours,
  /// and the other two for those between their corners. All others keep their labels. That is exact
  /// unless the change affects tetrahedra farther away, which happens in pockets with weak
  /// evidence. To correct these, call restore() from time to time or before saving. Other rules:
  /// calls update().
  void update_nearby(const Triangulation& triangulation,
                     const typename Triangulation::Changes& changes);

  /// Accepts any handle. Returns false for handles not in use.
  [[nodiscard]] bool kept(TetrahedronId tetrahedron) const;
  /// Number of kept tetrahedra. O(1).
  [[nodiscard]] std::size_t kept_count() const;
  /// Number of tetrahedra put back after the flood to give a vertex one.
  [[nodiscard]] std::size_t rescued_count() const;
  /// The vertices, sorted by slot, that the rule loses. Poles: vertices that are not on the
  /// surface. Other rules: vertices that the rule by itself leaves without a tetrahedron. With
  /// keep_vertices and the flood rule, those that were given one back. Empty while there are no
  /// tetrahedra.
  [[nodiscard]] std::vector<VertexId> lost_vertices() const;
  /// The kept tetrahedra, sorted by slot. O(slots).
  [[nodiscard]] std::vector<TetrahedronId> kept_tetrahedra() const;

  /// The facets between kept tetrahedra and the outside, counter-clockwise seen from outside. Every
  /// edge is in as many of them in one direction as in the other, so the surface is closed. Where
  /// kept tetrahedra meet only in an edge, that edge is in four or more faces. Where they meet only
  /// in a vertex, the surface touches itself there. Faces are sorted by the slot of their
  /// tetrahedron. O(slots).
  [[nodiscard]] ShapeSurface surface(const Triangulation& triangulation) const;
  /// Like surface(), but leaves out the lids of an open scan: the faces with which the poles rule
  /// closes the areas that were not scanned. A face is a lid if one of its edges is more than 10
  /// times as long as the spacing at each of its corners, which is the third shortest edge of the
  /// triangulation there. If lids are more than a tenth of the area, the scan is open and they are
  /// left out. Otherwise the surface is complete. Lengths and areas are those of the metric.
  /// O(slots).
  [[nodiscard]] ShapeSurface surface_without_lids(const Triangulation& triangulation) const;
  /// The parts of this shape's surface, with or without lids. Where four or more faces meet in an
  /// edge, only those that bound the same inside are joined there, whereas measure() joins all.
  /// O(slots).
  [[nodiscard]] ShapeParts parts(const Triangulation& triangulation,
                                 const ShapeSurface& surface) const;
  /// The sum of the volumes of the kept tetrahedra. O(slots).
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
  /// 0 triangulates the points unchanged. 1 to 30 rounds the points to integers of this many bits
  /// over the longest side of their bounding box, which is faster. 24 is finer than a float. The
  /// first of several points that coincide after rounding represents them. The surface always has
  /// the given coordinates.
  unsigned quantise_bits = 0;
  /// An elliptical metric for triangulating the points and classifying the facets, see BasicShape3.
  /// Cannot be combined with quantise_bits.
  std::optional<EllipticalMetric3> metric;
  /// 0: one per core. The result does not depend on it.
  unsigned threads = 1;
  base::StopCheck check_stop = {};
};

struct RestoredSurface {
  Surface surface;
  /// The input index of each point of the surface.
  std::vector<std::size_t> input{};
  /// Points that are not a corner of any face. A point that coincides with another counts with it.
  std::size_t unused_points = 0;
  /// True if the scan is open, so that the lids over areas that were not scanned were left out
  /// (poles rule only), see BasicShape3::surface_without_lids().
  bool open = false;
  std::size_t lids = 0;  ///< lids left out or, if the scan is not open, among the faces
  ShapeParts parts{};    ///< see BasicShape3::parts()
};

/// Returns the surface from which the points were scanned. It has no faces if all points (after any
/// rounding) are in one plane. Duplicates do not matter. A function of the points, their order and
/// the options.
///
/// Throws std::invalid_argument, naming the index, for a point that is not finite, and for options
/// out of range (including a metric together with rounding).
///
/// Costs a triangulation and the shape, each 0.2 to 0.3 s per 100,000 points.
RestoredSurface restore_surface(std::span<const Point3> points, const RestoreOptions& options = {});

}  // namespace terrace::tri
