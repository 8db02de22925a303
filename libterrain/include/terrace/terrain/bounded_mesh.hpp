// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <terrace/stream/mesh_writer.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/grid_tin.hpp>
#include <terrace/tri/point_tin.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/fill.hpp"
#include "terrace/terrain/region.hpp"
#include "terrace/terrain/triangle_mesh.hpp"

/// Meshes whose vertical error is bounded, and measured at every sample.

namespace terrace::terrain {

struct BoundedMeshOptions {
  double max_error = 0.0;        ///< metres
  std::uint64_t max_points = 0;  ///< 0: no limit; else max_error is not used
  tri::TinQuality quality = tri::TinQuality::kRemoval;
  /// kAll: an error where samples of one place differ by more than max_error.
  tri::PointDuplicates duplicates = tri::PointDuplicates::kAll;
  Fill fill = Fill::none;          ///< of a raster's cells
  std::optional<Region> region{};  ///< in the store's CRS
  /// To the CRS in which the mesh is written. The bound holds there: every sample is moved, and
  /// measured against the surface over that x and y.
  PlaceConversion places{};
  std::string path{};              ///< of the mesh; "-" is standard output
  stream::WriterOptions writer{};  ///< its format; the context's stop counts, not this one's
  /// Irregular samples meshed at once, at most; the mesh depends on it.
  std::size_t window_points = std::size_t{1} << 18;
};

/// What was measured on the mesh as a reader of the file gets it back, at every sample at full
/// resolution that has data and lies on a triangle.
struct BoundedMeshResult {
  std::uint64_t vertices = 0, triangles = 0;
  double max_error = 0.0, rms_error = 0.0;  ///< metres
  std::uint64_t samples = 0;                ///< with data, in the region; of a view those of it
  std::uint64_t uncovered = 0;              ///< of these, those on no triangle: they have no error
  std::uint64_t duplicates = 0;             ///< samples at the place of another
  double reading_seconds = 0.0;             ///< of all threads together, decoding included
  double meshing_seconds = 0.0;             ///< likewise, the check included
  MeshCoordinates coordinates{};            ///< of the file
};

/// Writes the mesh of a store's samples at full resolution, with the fewest triangles within the
/// bound or the smallest bound that so many points reach.
///
/// Works window by window: windows depend on the data and the bound alone, what lies on their sides
/// on the samples there alone. A finished window is spooled beside `path` and forgotten. Of
/// irregular points the mesh covers the convex hull; up to options.window_points they are meshed as
/// a whole, above that after one pass that finds the hull and the windows. With `places` irregular
/// points are meshed where they are moved; a raster's triangles are made on its lattice, in windows
/// so small that an edge, which is straight in the file, is within an eighth of a cell of the
/// samples along it. Reports "samples".
/// Throws: stream::Error on a damaged store, if the memory does not suffice (says what it needs),
/// or if the format's numbers are too coarse for the bound; UsageError; stream::Stopped. The file
/// is whole or not there.
BoundedMeshResult write_bounded_mesh(const stream::Store& store, const BoundedMeshOptions& options,
                                     const Context& context = {});

}  // namespace terrace::terrain
