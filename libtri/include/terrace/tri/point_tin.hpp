// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/tri/grid_tin.hpp"

/// Error-bounded triangulated surfaces (TINs) of irregular points: few vertices, vertically within
/// a given error of every sample.
///
/// Vertices are inserted greedily (M. Garland, P. S. Heckbert, "Fast polygonal approximation of
/// terrains and height fields", CMU-CS-95-181), with a list of samples per triangle. With a quality
/// that removes vertices again, as long as every sample stays within the error, sweeps over the
/// samples insert most vertices beforehand, without regard to the order of their errors. This
/// leaves as few vertices and is faster.

namespace terrace::tri {

/// Which of several samples at the same x, y counts. Except with `all`, only its height is
/// measured.
enum class PointDuplicates : std::uint8_t {
  first,
  min,
  max,
  mean,
  all,    ///< the lowest and the highest are measured, which bounds the error of all others
  error,  ///< throws std::invalid_argument naming the first sample at the position of an earlier
          ///< one
};

/// A lattice for vertices: integer x and y, and heights origin + k * step for integer k.
struct TinLattice {
  double height_origin = 0;
  double height_step = 0;  ///< positive
};

struct PointTinOptions {
  /// The error bound, >= 0, in the unit of heights. 0 keeps every sample that is not exactly on the
  /// surface.
  double max_error = 0;
  TinQuality quality = TinQuality::removal;
  PointDuplicates duplicates = PointDuplicates::first;
  /// Maximum number of vertices, including those of the frame (or the hull's corners), which are
  /// never dropped. 0 means no limit. If it is reached first, max_error is exceeded and
  /// PointTin::errors reports by how much.
  std::size_t max_points = 0;
  /// Removal does not create triangles with a smaller angle in the plane unless they are Delaunay.
  /// 0 to 30.
  double min_angle_degrees = 5;
  /// Rounds the position of a vertex to integers (halves up) and its height to the lattice. If
  /// several samples round to one position, the first one inserted is the vertex. Errors are
  /// measured at the samples' true positions. Requires a frame with integer x, y in [0, 2^30).
  std::optional<TinLattice> lattice;
  /// Called for each vertex and at intervals between. An exception ends the work.
  base::StopCheck check_stop{};
};

/// The value of PointTin::sample for a vertex of the frame.
inline constexpr std::uint32_t kNoSample = 0xFFFFFFFFu;

/// Vertical distances of samples from a surface.
struct TinErrors {
  std::size_t covered = 0;    ///< samples in the surface's triangles, including borders
  std::size_t uncovered = 0;  ///< all other samples, which are not measured
  double largest = 0;
  double rms = 0;
  /// A sample with the largest error. measure_surface() reports the one with the least x, y, z.
  std::uint32_t largest_at = kNoSample;
};

struct PointTin {
  std::vector<Point3> vertices;  ///< those of the frame come first, in its order
  /// The sample from which each vertex was made, parallel to `vertices`.
  std::vector<std::uint32_t> sample;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< vertices, counter-clockwise
  /// Errors of all samples after duplicates were merged. With `all` those of the lowest and the
  /// highest sample of each position. errors.largest <= max_error, unless max_points was reached or
  /// samples are `stuck`.
  TinErrors errors;
  std::size_t duplicates = 0;  ///< samples at the position of an earlier one
  double duplicate_range = 0;  ///< the largest difference between heights at one position
  /// Samples beyond max_error that cannot become vertices: they are on a side of the frame, their
  /// lattice position is taken or on a side, or their position already has a vertex (with `all`,
  /// where samples of one position differ by more than max_error).
  std::size_t stuck = 0;
  std::size_t inserted = 0;  ///< vertices inserted, not counting the corners of the frame or the
                             ///< hull
  std::size_t removed = 0;   ///< inserted vertices that were removed again
};

/// Builds the surface of samples x[i], y[i], z[i].
///
/// `frame`: the region, a convex, counter-clockwise polygon of positive area with at least 3
/// vertices, several of which may be on one straight side. Its vertices and sides are kept exactly
/// as given. Samples inside and on the sides are covered. Samples outside, however close, are
/// counted as uncovered and have no influence. Without a frame the region is the convex hull of the
/// samples: its corners are vertices, so every sample is covered. Other samples on the hull's
/// boundary become vertices only where the error requires it. Fewer than 3 samples, or collinear
/// samples, have no surface: the result has no vertices and all samples are uncovered.
///
/// The result depends only on the arguments and has the same bytes on every machine. The order of
/// samples at different positions does not matter. Runs in one thread. Takes about n log n time for
/// n samples: on a processor of 2024, 0.3 us per sample and 1.3 us per vertex inserted. With
/// removal 0.7 us per vertex inserted and 1 us more to try to remove it. Memory: 36 bytes per
/// sample and about 100 per vertex inserted, including the result.
///
/// With max_points greedy insertion stops there. The other qualities search for the error bound
/// that leaves nearly that many vertices, which takes up to 8 times as long.
///
/// Throws std::invalid_argument, naming the index, for a coordinate or height that is not finite or
/// above 1e100 in absolute value, for a frame vertex where the polygon is not convex, and for a
/// duplicate with `error`. Throws it also for options out of range and arrays of different lengths.
/// Throws std::length_error for more than 2^29 samples.
[[nodiscard]] PointTin point_tin(std::span<const double> x, std::span<const double> y,
                                 std::span<const double> z, std::span<const Point3> frame,
                                 const PointTinOptions& options);

/// Samples in rows and columns: sample row * x.size() + column is at x[column], y[row].
struct SampleRows {
  std::span<const double> x;  ///< one per column
  std::span<const double> y;  ///< one per row
  std::span<const double> z;  ///< row by row. NaN means missing
};

/// Samples on an approximately regular grid, such as a raster in another projection. The sample
/// with the number row * columns + column has the x and y with that index.
struct SampleGrid {
  std::size_t columns = 0;
  std::span<const double> x;  ///< row by row, as are y and z
  std::span<const double> y;
  std::span<const double> z;  ///< NaN: missing
};

/// Builds the surface of samples in rows and columns, with the same guarantees but not the same
/// vertices.
///
/// Up to 10 times as fast where few samples become vertices, if the frame is an axis-parallel
/// rectangle with coordinates below 2^20, the options have a lattice and no max_points, and there
/// are at most 65,535 columns and rows. The x and y of SampleRows must ascend at equal spacing (to
/// within a thousandth of it). The positions of SampleGrid must be within 4 spacings of an affine
/// image of columns and rows, and the closer they are the faster it is. Otherwise this calls the
/// function above. On a processor of 2024 with AVX-512 it takes 0.02 us per sample and 1 us per
/// vertex inserted, two thirds as much again for removal, and up to a third more for SampleGrid.
/// Memory: 16 bytes per sample (SampleGrid: 32) and 200 per vertex inserted.
[[nodiscard]] PointTin point_tin(const SampleRows& samples, std::span<const Point3> frame,
                                 const PointTinOptions& options);
[[nodiscard]] PointTin point_tin(const SampleGrid& samples, std::span<const Point3> frame,
                                 const PointTinOptions& options);

/// Measures samples against any surface whose triangles do not overlap, however it was made.
/// Measures every one of several samples at the same position. Finds the triangle of each sample
/// through a raster of cells and exact predicates. Computes heights in extended precision. O(n +
/// triangles) for well-shaped surfaces. Throws std::invalid_argument for arrays of different
/// lengths and for a triangle with a vertex that does not exist.
[[nodiscard]] TinErrors measure_surface(std::span<const double> x, std::span<const double> y,
                                        std::span<const double> z, std::span<const Point3> vertices,
                                        std::span<const std::array<std::uint32_t, 3>> triangles,
                                        const base::StopCheck& check_stop = {});

struct LineVertex {
  double t = 0;
  double height = 0;
  std::uint32_t sample = 0;  ///< the sample from which it was made
};

struct SimplifiedLine {
  std::vector<LineVertex> vertices;  ///< ascending in t. The first and the last are the ends
  double largest_error = 0;          ///< of all samples; exceeds max_error only on a lattice
};

/// Returns a chain of few vertices within max_error of each sample along a line. It starts with the
/// two ends and repeatedly adds the sample of greatest error (the first on ties). It depends only
/// on these samples, so both sides of a border get the same chain.
///
/// t: positions along the line, ascending. The first of several samples at one position counts. On
/// a lattice, t and heights of vertices are rounded as in point_tin(). Errors are measured at the
/// true positions. If a position on the lattice is taken, the error may stay above max_error.
///
/// Throws std::invalid_argument, naming the index, for a t that descends and for a value that is
/// not finite. Throws it also for max_error < 0 and arrays of different lengths. Without samples
/// there are no vertices. Usually O(n log n), at worst O(n^2).
[[nodiscard]] SimplifiedLine simplify_line(std::span<const double> t,
                                           std::span<const double> heights, double max_error,
                                           const std::optional<TinLattice>& lattice = {},
                                           const base::StopCheck& check_stop = {});

}  // namespace terrace::tri
