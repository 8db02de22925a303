// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/tri/interpolation.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The surface at a place; NaN where there is no surface.
struct SurfacePoint {
  double height = std::numeric_limits<double>::quiet_NaN();
  /// Height gained per column and per row, or per unit of x and of y.
  double per_column = std::numeric_limits<double>::quiet_NaN();
  double per_row = std::numeric_limits<double>::quiet_NaN();
};

struct SamplerOptions {
  tri::Interpolation method = tri::Interpolation::linear;
  unsigned level = 0;  ///< uses the points of this level and above
  /// Uses the points of finer levels too, in these regions: the surface of mixed levels.
  std::vector<FinerRegion> focuses{};
  /// Uses a surface of few samples that is within this many metres of every sample, vertically.
  /// Excludes a level, focuses, max_edge and other methods than linear.
  std::optional<double> max_error{};
  /// Ignores triangles with a side longer than this, in metres on the ground. Does not apply to
  /// rasters at level 0.
  std::optional<double> max_edge{};
  /// If false, gradients may be NaN where they cost more than the height.
  bool gradients = true;
};

/// Computes heights and gradients of a store's surface at many places per call.
///
/// Rasters at level 0:
/// - linear: on the triangulated lattice of all samples. On edges and samples, where triangles
///   differ, the gradient is the mean over the triangles that meet there.
/// - natural: Sibson's natural neighbour interpolation of all samples of the lattice, and its
///   gradient (see terrace/tri/interpolation.hpp); NaN if any of the neighbours has no data.
/// - nearest: the sample whose cell contains the place, up to half a cell around the lattice;
///   between two, the one with the larger column and row. The gradient is the linear surface's at
///   that sample.
/// Stores of points, and higher levels of rasters, use the exact Delaunay triangulation of the
/// level's points in stored x and y. Of several points at one x and y the first counts, higher
/// levels first:
/// - linear: on its triangles. On edges and points, where triangles differ, the gradient is the
///   mean over the triangles that meet there. NaN outside the hull.
/// - natural: Sibson's natural neighbour interpolation among all points of the level, and its
///   gradient. NaN outside the hull.
/// - nearest: the nearest point, on ties the lexicographically smallest; defined everywhere. The
///   gradient is the linear surface's at that point.
/// With focuses, the points of the level also include those of finer levels in all clusters that
/// reach into a focus, as in detail_mesh(), so the linear surface is that mesh:
/// - A triangle of level 0 with all corners inside a focus of level 0 is also one of this surface,
///   and inside it linear results are the same to the last bit (in a raster, up to rounding). The
///   same holds for a focus of another level, away from finer focuses.
/// - In a raster, results of all methods are those of level 0 to the last bit, with its missing
///   data, where the part of the raster within two columns and rows of a place is inside one focus
///   of level 0. Elsewhere the triangulation also spans missing data, as at higher levels.
/// - Where no finer point that is used is inside the circumcircle of a triangle of the level, the
///   surface is that of the level. Between the two are triangles with corners of several levels.
///
/// With SamplerOptions::max_error the surface is a triangulation of few samples, made in windows of
/// about 512 columns and rows, or 65,536 points:
/// - It is within the bound of every sample, up to rounding. Of several points at one x and y the
///   first counts. It passes through the samples that are corners of its triangles; on the sides of
///   windows of points, corners are between samples.
/// - It has heights where the linear surface of level 0 has them: missing samples of a raster leave
///   the same gaps. Next to gaps, where no triangle of few samples may be, it is that surface.
/// - Gradients are those of its triangles, on edges and corners their mean.
/// - It depends on the store and the bound alone. So a place has the same height in every request.
///
/// With SamplerOptions::max_edge every method gives NaN inside triangles with a longer side, but
/// not on their shorter sides and corners.
///
/// A call sorts its places by windows of the store, so pass many at once. Rasters at level 0 read
/// each window once, at about 25 ns per sample. Otherwise nothing is triangulated: the points
/// around the places are read, at about 0.15 us per point, and each place then costs about 1 us
/// (natural, and nearest with its gradient: 3 to 9 us). Results depend on neither threads, memory
/// nor the order of the places. With max_error each window with a place is triangulated, at about
/// 0.1 us per sample and 5 us per sample that becomes a corner, and kept for later calls while an
/// eighth of the memory has room; each place then costs about 0.3 us.
class HeightSampler {
 public:
  virtual ~HeightSampler() = default;

  /// places: stored coordinates (column and row, or x and y); places that are not finite get no
  /// height. out: one result per place, in the same order; heights in the store's vertical unit,
  /// gradients per unit of stored coordinates. Throws: stream::Error on damage; stream::Stopped.
  virtual void sample(std::span<const Point2> places, std::span<SurfacePoint> out) = 0;
};

/// Makes a sampler of a store. It uses half of the available memory unless the context sets another
/// bound. Throws: UsageError for a level that the store does not have, for a max_edge that does not
/// apply, and for a max_error that is negative or excluded; stream::Error, also if the memory does
/// not suffice for a window of a max_error; stream::Stopped.
std::unique_ptr<HeightSampler> make_sampler(const stream::Store& store,
                                            const SamplerOptions& options = {},
                                            const Context& context = {});

/// The surface at a place of the CRS; NaN where there is no surface.
struct GroundPoint {
  double height = std::numeric_limits<double>::quiet_NaN();
  /// Metres of height gained per metre on the ground towards east and north (of the CRS).
  double east = std::numeric_limits<double>::quiet_NaN();
  double north = std::numeric_limits<double>::quiet_NaN();
};

/// Samples places in the store's CRS, as HeightSampler does for stored coordinates. A place within
/// a millionth of a cell of a raster's column or row is treated as on it. Uses 90 bytes of memory
/// per place, with focuses or a bound 154. Throws: as make_sampler() and HeightSampler::sample().
std::vector<GroundPoint> sample_places(const stream::Store& store, std::span<const Point2> places,
                                       const SamplerOptions& options = {},
                                       const Context& context = {});

}  // namespace terrace::terrain
