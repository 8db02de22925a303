// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "terrace/tri/grid_tin.hpp"

/// Error-bounded triangulated surfaces (TINs) of irregular points: few vertices, and the surface is
/// vertically within a given error of every sample.
///
/// Greedy insertion (M. Garland, P. Heckbert, "Fast polygonal approximation of terrains and height
/// fields", CMU-CS-95-181) with lists of samples per triangle; then vertices are removed again
/// while every sample stays within the error.

namespace terrace::tri {

/// Which of several samples at one x,y counts: one height stands for them and it alone is measured,
/// unless all count.
enum class PointDuplicates : std::uint8_t {
  kFirst,
  kMin,
  kMax,
  kMean,
  kAll,    ///< the lowest and the highest are measured, so the surface is as close to all others
  kError,  ///< std::invalid_argument names the first that has the place of an earlier one
};

/// Vertices on a lattice: at whole x and y, with heights origin + k * step, k whole.
struct TinLattice {
  double height_origin = 0;
  double height_step = 0;  ///< > 0
};

struct PointTinOptions {
  /// In the unit of heights, >= 0. 0 keeps every sample that is not exactly on the surface.
  double max_error = 0;
  TinQuality quality = TinQuality::kRemoval;
  PointDuplicates duplicates = PointDuplicates::kFirst;
  /// At most this many vertices, those of the frame (or the hull's corners) included and never
  /// dropped; 0: no limit. Where it is reached first, max_error is not kept and
  /// PointTin::errors tells what was reached.
  std::size_t max_points = 0;
  /// Removal makes no triangle with a smaller angle (in the plane), unless it is Delaunay. 0 to 30.
  double min_angle_degrees = 5;
  /// Vertices stand at their sample's place rounded to whole numbers (halves up) and at its height
  /// rounded to the lattice; of samples rounded to one place the first one taken stands. Errors are
  /// measured at the samples' true places. Needs a frame with whole x, y below 2^30, >= 0.
  std::optional<TinLattice> lattice;
};

/// What PointTin::sample says of a vertex of the frame.
inline constexpr std::uint32_t kNoSample = 0xFFFFFFFFu;

/// Vertical distances of samples from a surface.
struct TinErrors {
  std::size_t covered = 0;    ///< samples inside the surface's triangles, borders included
  std::size_t uncovered = 0;  ///< the others: not measured
  double largest = 0;
  double rms = 0;
  std::uint32_t largest_at = kNoSample;  ///< a sample with that error
};

struct PointTin {
  std::vector<Point3> vertices;  ///< the frame's first, in its order
  /// The sample that a vertex was taken from, in parallel to `vertices`.
  std::vector<std::uint32_t> sample;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< vertices, counter-clockwise
  /// Measured at every sample in the finished surface, after duplicates were merged; with kAll at
  /// the lowest and the highest sample of a place.
  /// errors.largest <= max_error, unless max_points was reached or samples are `stuck`.
  TinErrors errors;
  std::size_t duplicates = 0;  ///< samples that share a place with an earlier one
  double duplicate_range = 0;  ///< the largest difference of heights at one place
  /// Samples beyond max_error that cannot become vertices: they lie on the frame's sides, which are
  /// kept, or their place on the lattice is taken or on a side, or the place has a vertex already
  /// (kAll, where samples of one place differ by more than max_error).
  std::size_t stuck = 0;
  std::size_t inserted = 0;  ///< vertices of the greedy surface beside the frame's or the corners
  std::size_t removed = 0;   ///< of these, removed again
};

/// The surface of samples x[i], y[i], z[i].
///
/// `frame`: the region, a convex polygon, counter-clockwise, strictly around an area, of at least 3
/// vertices; several on one straight side are allowed. Its vertices and sides are kept exactly as
/// given. Samples inside and on the sides are covered; those outside, be it by a hair, are counted
/// as uncovered and have no influence. Without a frame the region is the samples' convex hull: its
/// corners are vertices, so that every sample is covered; other samples on the hull's boundary
/// become vertices only where the error asks for it. Samples that are all on one line (or fewer
/// than 3) have no surface: no vertex, all uncovered.
///
/// Depends on the arguments alone: the same bytes on every machine; the order of samples at
/// different places hardly matters. One thread. About n log n for n samples: on a processor of 2024
/// 0.2 us per sample and 1.3 us per vertex made on the way, removal as much again; 36 bytes per
/// sample, and about 100 per vertex made on the way, the result included.
///
/// max_points: greedy insertion stops there; for the other qualities the bound that leaves nearly
/// as many is searched for, which takes up to 8 times as long.
///
/// Throws std::invalid_argument naming the index of a coordinate or height that is not finite or of
/// a size above 1e100, of a frame vertex where the polygon is not convex, of a duplicate with
/// kError; for options out of range or arrays of different lengths; std::length_error for more than
/// 2^29 samples.
[[nodiscard]] PointTin point_tin(std::span<const double> x, std::span<const double> y,
                                 std::span<const double> z, std::span<const Point3> frame,
                                 const PointTinOptions& options);

/// Samples in rows and columns: number row * x.size() + column is at x[column], y[row].
struct SampleRows {
  std::span<const double> x;  ///< of the columns
  std::span<const double> y;  ///< of the rows
  std::span<const double> z;  ///< row by row; NaN: there is no such sample
};

/// Samples that stand about in rows and columns, as those of a raster in another projection: number
/// row * columns + column is at x, y of that number.
struct SampleGrid {
  std::size_t columns = 0;
  std::span<const double> x;  ///< row by row, as y and z
  std::span<const double> y;
  std::span<const double> z;  ///< NaN: there is no such sample
};

/// The same of samples in rows and columns, with the same promises, but not the same surface.
///
/// Faster, up to 10 times where few samples become vertices, if the frame is an upright rectangle
/// with coordinates below 2^20, the options have a lattice and no max_points, there are at most
/// 65,535 columns and rows, and x and y of SampleRows ascend at equal distances (but for a
/// thousandth), or places of SampleGrid are an affine image of columns and rows but for 4 of their
/// distances; the less they are off the faster. On a processor of 2024 with AVX-512: 0.02 us per
/// sample and 1 us per vertex made on the way, removal two thirds as much again; SampleGrid takes
/// up to a third longer. 16 bytes per sample (SampleGrid: 32) and 200 per vertex made on the way.
/// Else it calls the other.
[[nodiscard]] PointTin point_tin(const SampleRows& samples, std::span<const Point3> frame,
                                 const PointTinOptions& options);
[[nodiscard]] PointTin point_tin(const SampleGrid& samples, std::span<const Point3> frame,
                                 const PointTinOptions& options);

/// Measures samples against any surface whose triangles do not overlap: independent of how it was
/// made. Samples of equal place are each measured. Finds every sample's triangle with exact
/// predicates by way of a raster of boxes; heights in double. O(n + triangles) for well-shaped
/// surfaces. Throws std::invalid_argument for a triangle naming a vertex that is not there.
[[nodiscard]] TinErrors measure_surface(std::span<const double> x, std::span<const double> y,
                                        std::span<const double> z, std::span<const Point3> vertices,
                                        std::span<const std::array<std::uint32_t, 3>> triangles);

struct LineVertex {
  double t = 0;
  double height = 0;
  std::uint32_t sample = 0;  ///< that it was taken from
};

struct SimplifiedLine {
  std::vector<LineVertex> vertices;  ///< ascending in t; the first and the last are the ends
  double largest_error = 0;          ///< over all samples; above max_error only on a lattice
};

/// The chain of few vertices through samples along a line that is within max_error of each of them:
/// the ends, and then always the sample of greatest error (of equal ones the first). Depends on
/// these samples alone, so both sides of a border get the same.
///
/// t: places along the line, ascending; of equal ones the first stands for all. On a lattice
/// vertices stand at rounded t and heights, as in point_tin(); errors are measured at the true
/// places, and where a place on the lattice is taken the error may stay above max_error.
///
/// Throws std::invalid_argument naming the index of a t that descends or of a value that is not
/// finite, for max_error < 0 or arrays of different lengths. No sample: no vertex. O(n log n)
/// usually, O(n^2) at worst.
[[nodiscard]] SimplifiedLine simplify_line(std::span<const double> t,
                                           std::span<const double> heights, double max_error,
                                           const std::optional<TinLattice>& lattice = {});

}  // namespace terrace::tri
