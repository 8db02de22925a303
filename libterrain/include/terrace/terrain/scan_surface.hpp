// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/shape.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/triangle_mesh.hpp"

/// The surface that the points of a scan lie on.

namespace terrace::terrain {

/// A caller's own way from points, in metres, to a surface.
struct SurfaceMethod {
  /// Corners that are input points are named in RestoredSurface::input; a surface without any has
  /// new points as its corners. Calls check_stop at intervals and lets its exceptions pass.
  std::function<tri::RestoredSurface(std::span<const tri::Point3>,
                                     const base::StopCheck& check_stop)>
      restore;
  std::uint64_t bytes_per_point = 0;  ///< peak memory
};

struct ScanSurfaceOptions {
  tri::RestoreOptions restore{};          ///< threads and check_stop are the context's
  std::optional<SurfaceMethod> method{};  ///< in place of tri::restore_surface()
  bool tetrahedra = false;  ///< the tetrahedra inside the surface, not triangles; without `method`
};

/// A surface, or the tetrahedra inside it. Positions are in the store's CRS.
struct ScanSurface {
  TriangleMesh mesh;
  std::vector<std::array<std::uint32_t, 4>> tetrahedra;  ///< where asked for, in place of triangles
  /// The surface's measures, in metres. Components and Euler characteristic are those of
  /// tri::ShapeParts; a surface by a method has those of tri::measure().
  tri::SurfaceMeasures measures;
  /// Samples that are a corner of no face; samples at the same place count once. nullopt of a
  /// surface that has corners of its own.
  std::optional<std::size_t> samples_off;
  /// Where nothing is enclosed: 0 if all points are at one place, 1 if they are on a line, 2 if
  /// they are in a plane, else 3.
  unsigned spanned = 3;
  /// The scan is open: the lids over what has not been scanned were left out, see
  /// tri::BasicShape3::surface_without_lids(). Never of tetrahedra, which fill the closed surface.
  bool open = false;
  std::size_t lids = 0;  ///< how many lids were left out or, if it is not open, are triangles
};

/// The surface of the points that `detail` wants, restored in metres on the ground: of points in
/// degrees about the middle of their box. Throws: stream::Error on a damaged store, and
/// where the points do not fit into the context's memory, saying what they need; UsageError for
/// tetrahedra beside a method; what the method throws; stream::Stopped.
[[nodiscard]] ScanSurface scan_surface(const stream::Store& store, const Detail& detail,
                                       const ScanSurfaceOptions& options = {},
                                       const Context& context = {});

}  // namespace terrace::terrain
