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

/// Meshes with a bounded vertical error that is measured at every sample.

namespace terrace::terrain {

struct BoundedMeshOptions {
  double max_error = 0.0;        ///< metres
  std::uint64_t max_points = 0;  ///< 0: no limit; otherwise max_error is ignored
  tri::TinQuality quality = tri::TinQuality::removal;
  /// With `all`, samples at one place that differ by more than max_error are an error.
  tri::PointDuplicates duplicates = tri::PointDuplicates::all;
  Fill fill = Fill::none;          ///< for cells of a raster without data
  std::optional<Region> region{};  ///< in the store's CRS
  /// Converts to the CRS of the mesh. The bound holds in that CRS: every sample is converted, then
  /// compared with the surface at its new x and y.
  PlaceConversion places{};
  std::string path{};              ///< output file; "-" is standard output
  stream::WriterOptions writer{};  ///< output format; Context::stop is used, not this one's
  /// Limit on the irregular samples that are meshed at once. The mesh depends on it.
  std::size_t window_points = std::size_t{1} << 18;
};

/// Measurements of the mesh as a reader of the file decodes it, taken at every full-resolution
/// sample that has data and is on a triangle.
struct BoundedMeshResult {
  std::uint64_t vertices = 0, triangles = 0;
  double max_error = 0.0, rms_error = 0.0;  ///< metres
  std::uint64_t samples = 0;                ///< with data, in the region and matching the store's
                                            ///< condition
  std::uint64_t uncovered = 0;              ///< samples on no triangle, included in `samples`: they
                                            ///< have no error
  std::uint64_t duplicates = 0;             ///< samples at the same place as another
  double reading_seconds = 0.0;             ///< sum over all threads, decoding included
  double meshing_seconds = 0.0;             ///< sum over all threads, the check included
  MeshCoordinates coordinates{};            ///< the coordinates in the file
};

/// Writes a mesh of a store's samples at full resolution: with the fewest triangles that keep the
/// bound, or with the smallest bound that `max_points` vertices can reach.
///
/// Works window by window. A window depends only on the data and the bound, and its sides only on
/// the samples along them. A finished window is spooled to a file next to `path` and released. A
/// mesh of irregular points covers their convex hull. Up to options.window_points of them are
/// meshed in one piece; more take an extra pass first, which finds the hull and the windows. With
/// `places`, irregular points are meshed at their converted places. A raster is still triangulated
/// on its lattice, in windows so small that an edge, which is straight in the file, is within an
/// eighth of a cell of the samples along it. Reports "samples".
/// Throws: stream::Error on a damaged store, if memory does not suffice (the message says how much
/// it needs), or if the format's numbers are too coarse for the bound; UsageError; stream::Stopped.
/// The file is either complete or absent.
BoundedMeshResult write_bounded_mesh(const stream::Store& store, const BoundedMeshOptions& options,
                                     const Context& context = {});

}  // namespace terrace::terrain
