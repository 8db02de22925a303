// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <terrace/base/stop_check.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/shape.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/scan_surface.hpp"

/// What scan_surface() does with both a restored surface and a stored one.

namespace terrace::terrain {

/// The points, their places on the ground, the surface, and bilateral smoothing, which begins after
/// the tetrahedra are freed.
inline constexpr std::uint64_t kSmoothingBytesPerPoint = 110 + 610;
/// The same for simplification.
inline constexpr std::uint64_t kSimplificationBytesPerPoint = 110 + 400;

/// Whether the surface is to have few triangles.
bool simplifies(const ScanSurfaceOptions& options);
/// Peak memory in bytes per point if the surface is restored.
std::uint64_t restoring_bytes_per_point(const ScanSurfaceOptions& options);
/// Returns metres about the middle of the positions, which are in the CRS.
std::vector<stream::Point3> on_ground(const std::vector<stream::Point3>& positions,
                                      const stream::StoreSchema& schema);
std::size_t distinct_places(std::vector<stream::Point3> points);
/// Sets the vertices of the mesh. samples: the places on the ground of the surface's points before
/// smoothing; empty without smoothing.
void set_vertices(const tri::RestoredSurface& surface, const std::vector<tri::Point3>& samples,
                  const TriangleMesh& points, const stream::StoreSchema& schema,
                  TriangleMesh& mesh);
/// Simplifies a surface and notes what it was. samples: places that belong to its points, or empty.
void simplify_scan(const ScanSurfaceOptions& options, const base::StopCheck& check_stop,
                   tri::RestoredSurface& surface, std::vector<tri::Point3>& samples,
                   ScanSurface& out);
/// Smooths a surface and returns the points that it had before.
std::vector<tri::Point3> smooth_scan(const ScanSurfaceOptions& options, const Context& context,
                                     tri::RestoredSurface& surface, ScanSurface& out);

/// Peak memory in bytes per point of input_surface() and the tree of its vertices, if there are at
/// most two triangles for each point.
inline constexpr std::uint64_t kInputSurfaceBytesPerPoint = 110 + 40 + 400;
/// Returns the triangles of the input over the points of a store, in metres on the ground;
/// `parts`, `lids` and the like are not set. points: by their numbers, in the CRS, which are those
/// of RestoredSurface::input. Of several points at one place it uses one of the highest level.
/// Notes the triangles that are left out: those with two corners at one place, and those with a
/// corner that was not selected. O(n log n). Throws: stream::Error if all are left out, the input
/// differs from the store, or the triangles need too much memory.
tri::RestoredSurface input_surface(const stream::Store& store, const TriangleMesh& points,
                                   const InputTriangles& triangles, const Context& context);

/// Whether the store has a surface that serves the request; see ScanSurfaceOptions::stored.
bool uses_stored_surface(const stream::Store& store, const Detail& detail,
                         const ScanSurfaceOptions& options);
/// Returns the stored surface, or a cut of it. Throws: as scan_surface().
ScanSurface stored_scan_surface(const stream::Store& source, const Detail& detail,
                                const ScanSurfaceOptions& options, const Context& context);

}  // namespace terrace::terrain
