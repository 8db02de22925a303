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

/// Meshes and points of mixed levels of detail: a level, a region, finer focuses.

namespace terrace::terrain {

/// Where the vertices of a mesh have other heights than in the store: first the overlay's, then
/// smoothed ones.
struct HeightOptions {
  /// With a region only inside it; its border stays. Works on the triangulation, so for rasters on
  /// the unit grid. An edge_height of 0 becomes four times the root mean square of the
  /// height differences along edges.
  std::optional<tri::SmoothingOptions> smoothing{};
  /// Replaces the heights of the points that it has; see open_height_overlay().
  stream::Overlay* overlay = nullptr;
  /// Gets the heights that in the end are not the store's, in the name of the vertices' points.
  stream::OverlayWriter* save = nullptr;

  [[nodiscard]] bool any() const { return smoothing || overlay != nullptr || save != nullptr; }
};

struct DetailMeshOptions {
  HeightOptions heights{};
  /// Elliptical: triangles within a region suit its metric on the ground (see
  /// tri::metric_triangles); outside all regions nothing changes. What triangles cover, and how
  /// many there are, does not depend on the metric.
  MetricChoice metric{};
};

/// The 2D Delaunay triangulation of what `detail` wants: rasters in column and row, exactly; other
/// points in x and y. Triangles of a raster that span samples without data are left out, as
/// StoreView::spans_gap() tells them. Positions are in the store's CRS, triangles counter-clockwise
/// seen from above, levels the highest of each vertex's point. With a region, the triangles that
/// reach into it, whole. With a cluster, of the points that it stands for alone; its representative
/// counts as of its level. The store never changes. One thread.
///
/// A store of triangles gives those that `detail` wants, bit for bit and with their orientation;
/// equal corners are one vertex. A triangle is where its first corner is, for
/// regions too. Without options.
///
/// Takes half of the available memory unless the context gives another bound. Throws:
/// stream::Error on a damaged store, or when the points would not fit, saying what they need;
/// UsageError for a metric that triangles cannot follow, for boxes on a rotated raster, for
/// options beside a store of triangles, for a cluster as for_each_wanted(), or heights beside one;
/// stream::Stopped.
[[nodiscard]] TriangleMesh detail_mesh(const stream::Store& store, const Detail& detail,
                                       const DetailMeshOptions& options = {},
                                       const Context& context = {});

/// The same points without triangles, of a region only those inside, with their colours, classes
/// and normals; `left_out` says where they are coarse. All are held in memory, 26 to 50 bytes each.
/// Throws: stream::Error on a damaged store.
[[nodiscard]] TriangleMesh detail_points(const stream::Store& store, const Detail& detail);

/// The finest level with at most `most_points` points; the top if none has so few. Reads the points
/// of a view, down to that level and the next, to count them. Throws, of a view: stream::Error on a
/// damaged store; stream::Stopped.
[[nodiscard]] unsigned level_within(const stream::Store& store, std::uint64_t most_points);

/// Opens an overlay with other heights of a store's points. Throws: stream::Error, as
/// Overlay::open and for one of other values than heights.
[[nodiscard]] stream::Overlay open_height_overlay(const std::string& path,
                                                  const stream::Store& store);

}  // namespace terrace::terrain
