// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/elliptical2.hpp"
#include "terrace/tri/metric2.hpp"
#include "terrace/tri/multiresolution_source.hpp"

namespace terrace::tri {

/// The triangles of a triangulation after its edges were flipped to suit a field of metrics (J.
/// Skala, Algorithms for manipulating large geometric data, 7.4, figures 7.15 and 7.16). The
/// vertices and the hull are those of the triangulation, which does not change; every triangle is
/// counter-clockwise, starts with its lexicographically smallest corner, and has a positive area.
///
/// A region is where the field gives one map. Guaranteed:
///  - A triangle with corners in different regions is one of the given triangulation, and all those
///    are kept: where regions meet nothing changes.
///  - An edge between two triangles whose corners all lie in one region is Delaunay in the metric
///    of that region: neither triangle's ellipse contains the fourth corner.
///  - So within each region these are the constrained Delaunay triangles, in its metric, of the
///    part covered by triangles with all corners in it. With ties broken as in Delaunay2 they are
///    unique: the set of triangles is a function of the points and the field alone, whatever the
///    history of the triangulation.
///  - Where all points lie in one region, the triangles are those of EllipticalDelaunay2.
/// For by a flip of an edge between two triangles of one region both stay in it, and the volume
/// below the surface of squared lengths in that region's metric shrinks: so flips end, and no
/// order or guard is needed. In-circle tests are exact on the given coordinates.
///
/// window: triangles whose bounding box does not meet it are left out before, and the edges at
/// those stay; only x and y count. What is said above then holds of the triangles of the window.
///
/// Throws: std::invalid_argument if the field gives a map at a vertex that is no metric, and what
/// the field throws. The map is asked for once per vertex (of the window). Costs O(n) beside the
/// flips, of which O(n^2) are possible, but few where ellipses are not extreme. Holds about 120
/// bytes per vertex while it runs, the result among them.
///
/// Triangulation: Delaunay2<std::int32_t>, Delaunay2<double> or EllipticalDelaunay2, by itself or
/// that of a MultiresolutionModel.
template <class Triangulation>
[[nodiscard]] std::vector<std::array<VertexId, 3>> metric_triangles(
    const Triangulation& triangulation, const MetricField2& field,
    const std::optional<Box3>& window = std::nullopt);

}  // namespace terrace::tri
