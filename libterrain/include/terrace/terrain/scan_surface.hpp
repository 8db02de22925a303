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
#include <terrace/stream/stored_surface.hpp>
#include <terrace/tri/shape.hpp>
#include <terrace/tri/surface_smoothing.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/input_triangles.hpp"
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
  /// Uses the surface that is stored with the points, if there is one. It serves whole stores, not
  /// views, regions or clusters, and not `method`, `tetrahedra`, or a shape or metric other than
  /// the default. A coarse or mixed detail cuts its tree (see tri::vertex_tree()), so the surface
  /// does not tear, and max_error and max_points choose a cut instead of simplifying again; after
  /// smoothing they simplify as without it.
  bool stored = true;
  tri::RestoreOptions restore{};          ///< threads and check_stop are taken from the context
  std::optional<SurfaceMethod> method{};  ///< replaces tri::restore_surface()
  bool tetrahedra = false;  ///< returns tetrahedra inside the surface instead of triangles; not
                            ///< with `method`
  /// Smooths the surface, in metres on the ground; threads and check_stop are taken from the
  /// context. Not with `tetrahedra`.
  std::optional<tri::SurfaceSmoothingOptions> smoothing{};
  /// Simplifies the surface within this distance in metres, see tri::simplify_surface(). Not with
  /// tetrahedra.
  std::optional<double> max_error{};
  /// Simplifies it to at most this many points, 4 or more, as far as that is possible without
  /// changing its topology. Not with max_error or tetrahedra. Both need all samples: a detail of
  /// level 0.
  std::optional<std::size_t> max_points{};
};

/// The full surface of a simplified one, and the distance between the two.
struct SimplifiedFrom {
  std::size_t vertices = 0, triangles = 0;
  double volume = 0.0;        ///< as in tri::SurfaceMeasures
  double max_distance = 0.0;  ///< metres, see tri::SimplifiedSurface::max_distance
};

/// A surface, or the tetrahedra inside it. Positions are in the store's CRS.
struct ScanSurface {
  TriangleMesh mesh;
  std::vector<std::array<std::uint32_t, 4>> tetrahedra;  ///< if requested, in place of triangles
  /// How far smoothing moved the vertices of the full surface, in metres; nullopt without
  /// smoothing.
  std::optional<tri::SurfaceMoves> moves;
  /// Measures of the surface, in metres; after smoothing and simplification. Components and Euler
  /// characteristic come from tri::ShapeParts or, for a surface made by `method`, from
  /// tri::measure().
  tri::SurfaceMeasures measures;
  /// Number of samples that are not a corner of any face of the full surface; samples at the same
  /// place count once. nullopt if the surface has new corners.
  std::optional<std::size_t> samples_off;
  /// Dimension of the points, if they enclose nothing: 0 if all are at one place, 1 if they are on
  /// a line, 2 if they are in a plane, otherwise 3.
  unsigned spanned = 3;
  /// True if the scan is open: lids over unscanned parts were left out, see
  /// tri::BasicShape3::surface_without_lids(). Always false for tetrahedra, which fill the closed
  /// surface.
  bool open = false;
  std::size_t lids = 0;  ///< number of lids left out or, if not open, kept as triangles (before any
                         ///< simplification)
  std::optional<SimplifiedFrom> simplified;  ///< if a simplification was requested
  /// True if this is the surface stored with the points, or a cut of it. Then `open` is whether it
  /// has a border, `lids` is 0, and `samples_off` is nullopt for a coarse or mixed detail.
  bool stored = false;
};

/// Restores the surface of the points that `detail` wants, in metres on the ground. Degrees are
/// converted about the middle of the points' box. With a cluster, uses only the points that it
/// represents, as if the store had no others. Throws: stream::Error on a damaged store, and if
/// the points do not fit in the context's memory (the message says how much they need); UsageError
/// for options that exclude each other or are out of range; stream::Stopped; any exception of the
/// method.
[[nodiscard]] ScanSurface scan_surface(const stream::Store& store, const Detail& detail,
                                       const ScanSurfaceOptions& options = {},
                                       const Context& context = {});

/// Makes the surface to be stored with the points, see BuildRequest::surface, and sorts its
/// vertices into a tree within the store's clusters. The surface consists of the input's triangles,
/// whatever their topology. Their corners at one place become one vertex, and triangles with two
/// equal corners are left out. Without triangles, the surface is restored through all points of the
/// store. Throws: as scan_surface(); stream::Error for points that enclose nothing, or if required
/// triangles are missing.
[[nodiscard]] stream::StoredSurface surface_to_store(const stream::Store& store,
                                                     const stream::ClusterOrder& order,
                                                     const Context& context = {},
                                                     const InputTriangles& triangles = {});

}  // namespace terrace::terrain
