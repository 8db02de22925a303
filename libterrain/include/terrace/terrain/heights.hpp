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
  tri::Interpolation method = tri::Interpolation::kLinear;
  unsigned level = 0;  ///< the points of this level and above
  /// Metres on the ground: triangles with a longer side do not count. Not for rasters at level 0.
  std::optional<double> max_edge{};
  /// False: where a gradient costs more than the height, it may be left out (NaN).
  bool gradients = true;
};

/// Heights and gradients of a store's surface at many places at a time.
///
/// Rasters at level 0:
/// - linear: on the triangulated lattice of all samples. On edges and samples, where
///   triangles differ, the gradient is the mean of those that meet there.
/// - natural: Sibson's natural neighbours of all samples of the lattice and its gradient (see
///   terrace/tri/interpolation.hpp); nothing where one of them has no data.
/// - nearest: the sample whose cell holds the place, up to half a cell around the lattice; of two
///   the one of the larger column and row. The gradient is the linear surface's at that sample.
/// Stores of points, and the other levels of rasters: the Delaunay triangulation in stored x,y of
/// the level's points, exactly; the first of several points at one x,y counts, higher levels first:
/// - linear: on its triangles. On edges and points, where triangles differ, the gradient is the
///   mean of those that meet there. NaN outside the hull.
/// - natural: Sibson's natural neighbours among all points of the level, and its gradient. NaN
///   outside the hull.
/// - nearest: the nearest point, the lexicographically smallest on ties; everywhere. The gradient
///   is the linear surface's at that point.
/// With SamplerOptions::max_edge every method gives NaN inside triangles that have a longer side,
/// but not on their shorter sides and corners.
///
/// Places are sorted by windows of the store within a call, so give many at once; each window is
/// read once: about 25 ns per sample of a raster at level 0. Elsewhere nothing is triangulated: the
/// points around the places are read, about 0.15 us per point, and each place then costs about 1 us
/// (natural, and nearest with its gradient: 3 to 9 us). Results depend on neither threads, memory,
/// nor the order of the places.
class HeightSampler {
 public:
  virtual ~HeightSampler() = default;

  /// places: stored coordinates (column and row, or x and y); those that are not finite have no
  /// height. out: as many, in their order; heights in the store's vertical unit, gradients per unit
  /// of stored coordinates. Throws: stream::Error on damage; stream::Stopped.
  virtual void sample(std::span<const Point2> places, std::span<SurfacePoint> out) = 0;
};

/// Takes half of the available memory unless the context gives another bound.
/// Throws: UsageError for a level that the store does not have, and for a max_edge that is refused;
/// stream::Error, stream::Stopped.
std::unique_ptr<HeightSampler> make_sampler(const stream::Store& store,
                                            const SamplerOptions& options = {},
                                            const Context& context = {});

/// The surface at a place of the CRS; NaN where there is none.
struct GroundPoint {
  double height = std::numeric_limits<double>::quiet_NaN();
  /// Metres of height gained per metre on the ground going east and north (of the CRS).
  double east = std::numeric_limits<double>::quiet_NaN();
  double north = std::numeric_limits<double>::quiet_NaN();
};

/// places: in the store's CRS; see HeightSampler for everything else. A place within a millionth of
/// a cell of a raster's column or row is taken to lie on it.
/// Takes 90 bytes per place. Throws: as make_sampler() and HeightSampler::sample().
std::vector<GroundPoint> sample_places(const stream::Store& store, std::span<const Point2> places,
                                       const SamplerOptions& options = {},
                                       const Context& context = {});

}  // namespace terrace::terrain
