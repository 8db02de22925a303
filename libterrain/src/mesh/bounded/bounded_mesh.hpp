// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <terrace/stream/mesh_writer.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/grid_tin.hpp>
#include <terrace/tri/point_tin.hpp>

#include "base/region.hpp"
#include "terrace/terrain/context.hpp"

/// Meshes with an error that is verified: what `mesh --max-error` and `mesh --max-points` write.

namespace terrace::terrain {

/// What a raster's cells without data become.
enum class Fill : std::uint8_t {
  none,         ///< holes
  flat,         ///< samples at the lowest height of the store
  interpolate,  ///< samples between the heights around
};
/// "none", "flat", "interpolate". Throws: UsageError.
Fill parse_fill(const std::string& text);
/// "greedy", "removal", "fitted". Throws: UsageError.
tri::TinQuality parse_quality(const std::string& text);

/// What is to be meshed to so that a reader of the file sees no more than the bound: heights move
/// by what they are rounded by, and a little with the places. Throws: stream::Error if the file's
/// format rounds too coarsely for that.
double aim_within(double bound, const stream::MeshRounding& rounding, const std::string& path);
/// "all", "min", "max", "mean", "first", "error". Throws: UsageError.
tri::PointDuplicates parse_duplicates(const std::string& text);

/// Irregular samples meshed at once, at most.
inline constexpr std::size_t kWindowPoints = std::size_t{1} << 18;

struct BoundedMeshOptions {
  double max_error = 0.0;        ///< metres
  std::uint64_t max_points = 0;  ///< 0: no limit; else max_error is not used
  tri::TinQuality quality = tri::TinQuality::kRemoval;
  /// kAll: an error where samples of one place differ by more than max_error.
  tri::PointDuplicates duplicates = tri::PointDuplicates::kAll;
  Fill fill = Fill::none;
  std::optional<Region> region;
  std::string path;                ///< of the mesh
  stream::WriterOptions writer{};  ///< its format
  std::size_t window_points = kWindowPoints;
};

/// What was measured on the mesh as a reader of the file gets it back, at every sample at full
/// resolution that has data and lies on a triangle.
struct BoundedMeshResult {
  std::uint64_t vertices = 0, triangles = 0;
  double max_error = 0.0, rms_error = 0.0;  ///< metres
  std::uint64_t samples = 0;                ///< with data, in the region if there is one
  std::uint64_t uncovered = 0;   ///< of these, such as lie on no triangle: they have no error
  std::uint64_t duplicates = 0;  ///< samples at the place of another
  double reading_seconds = 0.0;  ///< of all threads together, decoding included
  double meshing_seconds = 0.0;  ///< likewise, the check included
};

/// The mesh of a raster store, window by window: windows depend on the data and the bound alone,
/// what lies on their sides on the samples there alone. A finished window is spooled beside `path`
/// and forgotten. Throws: stream::Error on a damaged store, if --memory does not suffice (says what
/// it needs), or if the format's numbers are too coarse for the bound; UsageError.
BoundedMeshResult bounded_raster_mesh(const stream::Store& store, const BoundedMeshOptions& options,
                                      const Context& context);

/// The mesh of any other store: of its samples' convex hull. As a whole where it has no more than
/// options.window_points, else likewise window by window, after one pass over the samples that
/// finds the hull and the windows.
BoundedMeshResult bounded_point_mesh(const stream::Store& store, const BoundedMeshOptions& options,
                                     const Context& context);

}  // namespace terrace::terrain
