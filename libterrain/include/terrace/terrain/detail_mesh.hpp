// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <terrace/stream/overlay.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/smoothing.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/metric_choice.hpp"
#include "terrace/terrain/triangle_mesh.hpp"

/// Meshes and points of mixed levels of detail: a base level, a region, finer focuses.

namespace terrace::terrain {

/// Changes to the heights of a mesh's vertices: heights from an overlay first, smoothing second.
struct HeightOptions {
  /// With a region, smooths only inside it and keeps its border. Works on the triangulation, so on
  /// the unit grid for rasters. An edge_height of 0 becomes four times the root mean square of the
  /// height differences along edges.
  std::optional<tri::SmoothingOptions> smoothing{};
  /// Replaces the heights of the points that it contains; see open_height_overlay().
  stream::Overlay* overlay = nullptr;
  /// Receives the final heights that differ from the store's, keyed by the vertices' points.
  stream::OverlayWriter* save = nullptr;

  [[nodiscard]] bool any() const { return smoothing || overlay != nullptr || save != nullptr; }
};

struct DetailMeshOptions {
  HeightOptions heights{};
  /// If elliptical, triangles within a region follow its metric on the ground (see
  /// tri::metric_triangles), and nothing changes outside all regions. The covered area and the
  /// number of triangles do not depend on the metric.
  MetricChoice metric{};
};

/// Returns the 2D Delaunay triangulation of the points that `detail` wants. It is exact, in column
/// and row for rasters and in x and y for other points. Leaves out triangles of a raster that span
/// samples without data, see StoreView::spans_gap(). Positions are in the store's CRS, triangles
/// are counter-clockwise seen from above, and a vertex's level is the highest of its point. With a
/// region, returns every triangle that reaches into it, uncut. With a cluster, triangulates only
/// the points that the cluster represents; its representative counts as a point of the cluster's
/// level. The store never changes. Single-threaded.
///
/// For a store of triangles, returns those that `detail` wants, bit for bit and with their
/// orientation; equal corners become one vertex. A triangle is located at its first corner, also
/// with respect to regions. Options do not apply.
///
/// Uses half of the available memory unless the context sets another bound. Throws: stream::Error
/// on a damaged store, or if the points do not fit in memory (the message says how much they need);
/// UsageError for a metric that triangles cannot follow, for boxes on a rotated raster, for options
/// with a store of triangles, for an invalid cluster as for_each_wanted(), or for changed heights
/// together with a cluster; stream::Stopped.
[[nodiscard]] TriangleMesh detail_mesh(const stream::Store& store, const Detail& detail,
                                       const DetailMeshOptions& options = {},
                                       const Context& context = {});

/// Returns the points that `detail` wants without triangles, with their colours, classes and
/// normals. With a region, returns only points inside it. TriangleMesh::left_out records where they
/// are coarse. A point takes 26 to 50 bytes of memory. Throws: stream::Error on a damaged store.
[[nodiscard]] TriangleMesh detail_points(const stream::Store& store, const Detail& detail);

/// Returns the finest level with at most `most_points` points, or the top if every level has more.
/// In a view, reads the points of that level, of the levels above it and of the next level below
/// it, to count them. Throws (only in a view): stream::Error on a damaged store; stream::Stopped.
[[nodiscard]] unsigned level_within(const stream::Store& store, std::uint64_t most_points);

/// Opens an overlay that replaces heights of a store's points. Throws: stream::Error, as
/// Overlay::open(), and if its values are not heights.
[[nodiscard]] stream::Overlay open_height_overlay(const std::string& path,
                                                  const stream::Store& store);

}  // namespace terrace::terrain
