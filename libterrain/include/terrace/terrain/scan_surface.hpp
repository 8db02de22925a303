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

/// Surfaces from the points of a scan.

namespace terrace::terrain {

/// A method of the caller that makes a surface from points in metres.
struct SurfaceMethod {
  /// RestoredSurface::input names the corners that are input points; it is empty for a surface with
  /// new corners. Calls check_stop at intervals and lets its exceptions pass.
  std::function<tri::RestoredSurface(std::span<const tri::Point3>,
                                     const base::StopCheck& check_stop)>
      restore;
  std::uint64_t bytes_per_point = 0;  ///< peak memory
};

struct ScanSurfaceOptions {
  tri::RestoreOptions restore{};          ///< threads and check_stop are taken from the context
  std::optional<SurfaceMethod> method{};  ///< replaces tri::restore_surface()
  bool tetrahedra = false;  ///< returns tetrahedra inside the surface instead of triangles; not
                            ///< with `method`
};

/// A surface, or the tetrahedra inside it. Positions are in the store's CRS.
struct ScanSurface {
  TriangleMesh mesh;
  std::vector<std::array<std::uint32_t, 4>> tetrahedra;  ///< if requested, in place of triangles
  /// Measures of the surface, in metres. Components and Euler characteristic come from
  /// tri::ShapeParts or, for a surface made by `method`, from tri::measure().
  tri::SurfaceMeasures measures;
  /// Number of samples that are not a corner of any face; samples at the same place count once.
  /// nullopt if the surface has new corners.
  std::optional<std::size_t> samples_off;
  /// Dimension of the points, if they enclose nothing: 0 if all are at one place, 1 if they are on
  /// a line, 2 if they are in a plane, otherwise 3.
  unsigned spanned = 3;
  /// True if the scan is open: lids over unscanned parts were left out, see
  /// tri::BasicShape3::surface_without_lids(). Always false for tetrahedra, which fill the closed
  /// surface.
  bool open = false;
  std::size_t lids = 0;  ///< number of lids left out or, if not open, kept as triangles
};

/// Restores the surface of the points that `detail` wants, in metres on the ground. Degrees are
/// converted about the middle of the points' box. Throws: stream::Error on a damaged store, and if
/// the points do not fit in the context's memory (the message says how much they need); UsageError
/// for tetrahedra together with a method; stream::Stopped; any exception of the method.
[[nodiscard]] ScanSurface scan_surface(const stream::Store& store, const Detail& detail,
                                       const ScanSurfaceOptions& options = {},
                                       const Context& context = {});

}  // namespace terrace::terrain
