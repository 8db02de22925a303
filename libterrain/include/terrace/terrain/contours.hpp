// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

struct ContourRequest {
  double interval = 0;  ///< in the store's vertical unit, positive
  unsigned level = 0;   ///< uses the points of this level and above
  /// Uses the points of finer levels too, in these regions, as SamplerOptions does.
  std::vector<FinerRegion> focuses{};
  /// Uses the surface of few samples within this many metres of every sample, as SamplerOptions
  /// does. Excludes a level, focuses and max_edge.
  std::optional<double> max_error{};
  /// Leaves out triangles with a side longer than this, in metres on the ground.
  std::optional<double> max_edge{};
  std::optional<Region> region{};  ///< in the store's CRS
  /// Lines keep the store's x and y, and a `crs` member names their CRS (null if unknown).
  bool own_crs = false;
};

struct ContourOutcome {
  std::uint64_t lines = 0, closed = 0, points = 0;
};

/// Writes the contour lines of the linear surface as GeoJSON (RFC 7946). Each line is a LineString
/// in longitude and latitude of WGS 84, within 1e-10 degrees before rounding to nine decimals, with
/// its height as `elev` and higher ground on its right. A line that crosses the antimeridian is a
/// MultiLineString. ContourLevels says which results are exact.
///
/// The surface of a raster at level 0 is its triangulated lattice of samples. Otherwise it is the
/// Delaunay triangulation of the points of the level and above (see PointWindow), which spans the
/// points' convex hull, holes included, unless max_edge limits it. With focuses, it is that of the
/// points that detail_mesh() shows. Then triangles that span missing samples of a raster are left
/// out if the part of the raster within a cell of their middle is inside a focus of level 0. With
/// max_error, it is the triangles of the bounded surface that SamplerOptions describes; next to
/// missing samples, lines may end up to two cells earlier than those of level 0. With a
/// region, only squares of samples or triangles with their middles inside have lines, and the lines
/// end there.
///
/// write: receives the text in order, in large pieces. Reports "lines".
/// The lines and their order depend neither on threads nor on memory. Memory: one band of rows, or
/// per thread a part of 65,536 to 2^19 points, plus the lines that continue beyond it. Throws:
/// stream::Error if the store's CRS is needed and unknown, if the store does not meet the region or
/// is damaged, or if the lines in progress do not fit in memory; UsageError for a level that the
/// store does not have, for max_edge with a raster at level 0, and for a max_error that is negative
/// or excluded.
ContourOutcome write_contours(const stream::Store& store, const ContourRequest& request,
                              const std::function<void(std::string_view)>& write,
                              const Context& context = {});

}  // namespace terrace::terrain
