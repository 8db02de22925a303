// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "mesh/mesh_heights.hpp"
#include "mesh/scene.hpp"
#include "terrace/stream/store.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/metric_choice.hpp"

namespace terrace::terrain {

struct MeshOptions {
  HeightOptions heights;
  /// Elliptical: triangles within a region suit its metric on the ground (see
  /// tri::metric_triangles); outside all regions nothing changes.
  MetricChoice metric;
};

/// The 2D Delaunay triangulation of what `detail` wants: rasters in column and row, exactly; other
/// points in x and y. Positions are in the store's CRS, triangles counter-clockwise seen from
/// above, levels the highest of each vertex's point. With a region, the triangles that reach into
/// it, whole. memory_bytes: what the work may take. Throws: stream::Error on a damaged store, or
/// when the points would not fit, saying what they need; UsageError for a metric that triangles
/// cannot follow, and for boxes on a rotated raster. The store never changes.
TriangleMesh mesh_of_store(const stream::Store& store, const Detail& detail,
                           std::uint64_t memory_bytes, const MeshOptions& options = {});

/// The same points without triangles; `left_out` says where they are coarse.
TriangleMesh points_of_store(const stream::Store& store, const Detail& detail);

/// The finest level with at most `most_points` points; the top if none has so few.
unsigned level_within(const stream::Store& store, std::uint64_t most_points);

}  // namespace terrace::terrain
