// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

struct ContourRequest {
  double interval = 0;  ///< in the store's vertical unit, above 0
  unsigned level = 0;   ///< the points of this level and above
  /// Triangles with a longer side, in metres on the ground, are left out.
  std::optional<double> max_edge{};
  std::optional<Region> region{};  ///< in the store's CRS
  /// Lines keep the store's x and y, and a `crs` member names their CRS, null if it is not known.
  bool own_crs = false;
};

struct ContourOutcome {
  std::uint64_t lines = 0, closed = 0, points = 0;
};

/// The contour lines of the linear surface as GeoJSON (RFC 7946): one LineString in longitude and
/// latitude of WGS 84 per line, within 1e-10 degrees before they are rounded to nine decimals, with
/// its height as `elev`, higher ground on its right; a MultiLineString for one that the
/// antimeridian cuts. See ContourLevels for what is exact.
///
/// The surface of a raster at level 0 is its triangulated lattice of samples; else the Delaunay
/// triangulation of the points of the level and above (see PointWindow), which spans the points'
/// convex hull, holes and all, where max_edge does not say otherwise. With a region, the lines of
/// those squares of samples, or of those triangles, whose middles lie inside; they end there.
///
/// write: what takes the text, in order, much at a time. Reports "lines".
/// Lines and their order depend on neither threads nor memory. Memory: a band of rows, or parts of
/// 65,536 to 2^19 points per thread, and the lines that go on beyond. Throws: stream::Error if the
/// store's CRS is wanted and not known, if it does not meet the region, is damaged, or if the lines
/// at work do not fit; UsageError for a level that the store does not have, and for max_edge with a
/// raster at level 0.
ContourOutcome write_contours(const stream::Store& store, const ContourRequest& request,
                              const std::function<void(std::string_view)>& write,
                              const Context& context = {});

}  // namespace terrace::terrain
