// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "terrace/tri/delaunay3.hpp"
#include "terrace/tri/elliptical3.hpp"
#include "terrace/tri/metric3.hpp"

namespace terrace::tri {

struct MetricTetrahedra {
  /// In order (see Delaunay3); which corner is the first means nothing.
  std::vector<std::array<VertexId, 4>> tetrahedra;
  std::size_t flips = 0;
  /// Facets between two tetrahedra of one region that are not Delaunay in its metric and where no
  /// flip is possible.
  std::size_t stuck = 0;
};

/// The tetrahedra of a triangulation after flips that suit a field of metrics, as
/// metric_triangles() in the plane (J. Skala, Algorithms for manipulating large geometric
/// data, 7.4, figures 7.15 and 7.16). The vertices and the hull are those of the triangulation,
/// which does not change; every tetrahedron has a positive volume, they fill the hull, and each
/// facet belongs to two of them or to the hull.
///
/// A region is where the field gives one map. Guaranteed:
///  - A tetrahedron with corners in different regions is one of the given triangulation, and all
///    those are kept: where regions meet nothing changes.
///  - A facet between two tetrahedra whose corners all lie in one region is Delaunay in the metric
///    of that region (neither ellipsoid contains the other's fourth corner, ties broken as in
///    Delaunay3) or counted in `stuck`: there no flip of two tetrahedra into three, three into two,
///    or (with four corners in a plane) four into four or, on the hull, two into two is possible
///    without one of another region.
///  - In a region without a stuck facet these are the constrained Delaunay tetrahedra, in its
///    metric, of the part covered by tetrahedra with all corners in it: no ellipsoid contains a
///    vertex of that part that can be seen from its tetrahedron.
///  - The set of tetrahedra, and with it `stuck`, is a function of the points and the field alone,
///    whatever the history of the triangulation and the handles: flips go by the order of
///    coordinates.
///  - Where all points lie in one region, the tetrahedra are those of EllipticalDelaunay3, and none
///    is stuck.
/// Unlike in the plane flips may get stuck (B. Joe, "Three-dimensional triangulations from local
/// transformations", doi:10.1137/0910044), and the part may have no tetrahedra that are Delaunay.
/// By a flip the volume below the surface of squared lengths in the region's metric shrinks, and
/// regions do not touch each other: so flips end. All tests are exact on the given coordinates.
///
/// Throws: std::invalid_argument if the field gives a map at a vertex that is no metric, and what
/// the field throws. The map is asked for once per vertex. O(n log n) beside the flips, of which
/// O(n^2) are possible. Holds about 450 bytes per vertex while it runs, the result among them.
///
/// Triangulation: Delaunay3<std::int32_t>, Delaunay3<double> or EllipticalDelaunay3, by itself or
/// that of a MultiresolutionModel.
template <class Triangulation>
[[nodiscard]] MetricTetrahedra metric_tetrahedra(const Triangulation& triangulation,
                                                 const MetricField3& field);

}  // namespace terrace::tri
