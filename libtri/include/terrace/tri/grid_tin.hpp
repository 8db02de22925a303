// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

/// Builds TINs of raster windows, within an error bound at every sample.
///
/// Vertices are inserted greedily (M. Garland, P. S. Heckbert, "Fast polygonal approximation of
/// terrains and height fields", CMU-CS-95-181). Vertices that later ones made superfluous are then
/// removed.
///
/// Cut a large raster into windows that share their sides: the last column of one window is the
/// first column of the next. The vertices on a side depend only on the samples near that side
/// (settle_side()), so windows fit together without cracks and may be made in any order, each in
/// its own thread. These functions keep no state and start no threads.
///
/// No triangle contains a sample without data. Every sample with data is in a triangle if its 8
/// neighbours (those within the window) have data too. Elsewhere the boundary is arbitrary: land
/// less than three samples wide can vanish.

namespace terrace::tri {

using Point3 = std::array<double, 3>;

/// Samples on a lattice, row by row. A height that is not finite marks missing data.
template <class T>
struct GridWindow {
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  std::span<const T> heights;
};

struct GridTinCheck {
  double max_error = 0;  ///< vertical, over the covered samples
  double rms_error = 0;
  std::size_t samples = 0;                  ///< samples with data
  std::size_t covered = 0;                  ///< samples with data in a triangle
  std::size_t uncovered = 0;                ///< samples with data outside all triangles
  std::vector<std::uint32_t> uncovered_at;  ///< uncovered samples, numbered row by row
  /// Uncovered samples whose 8 neighbours (those within the window) have data.
  std::size_t uncovered_inner = 0;
  std::size_t nodata_covered = 0;  ///< samples without data in a triangle
  std::size_t inverted = 0;  ///< triangles without area, or oriented opposite to the first one
};

/// Measures every sample in every triangle, including its sides and corners, in double. Points are
/// column, row and height. They need not be on the lattice, as values read back from a file may
/// have been rounded. `tolerance` is how far they may have moved, in cells: a sample within this
/// distance outside a triangle counts as covered by it and is measured against its plane. Samples
/// without data count only inside triangles. Time O(samples + triangles + points). Memory: one byte
/// per sample and four per uncovered sample.
///
/// Throws std::invalid_argument if `heights` has the wrong length, if a corner is not the number of
/// a point, if a point is not finite or its column or row is more than 2^20 outside the window, and
/// if the tolerance is not in [0, 1].
template <class T>
GridTinCheck check_grid_tin(const GridWindow<T>& window, std::span<const Point3> points,
                            std::span<const std::array<std::uint32_t, 3>> triangles,
                            double tolerance = 0, const base::StopCheck& check_stop = {});

extern template GridTinCheck check_grid_tin(const GridWindow<float>&, std::span<const Point3>,
                                            std::span<const std::array<std::uint32_t, 3>>, double,
                                            const base::StopCheck&);
extern template GridTinCheck check_grid_tin(const GridWindow<double>&, std::span<const Point3>,
                                            std::span<const std::array<std::uint32_t, 3>>, double,
                                            const base::StopCheck&);

/// How much work to spend on reducing the number of triangles.
enum class TinQuality : std::uint8_t {
  greedy,   ///< insertion only: a Delaunay triangulation of its vertices, except at settled sides
  removal,  ///< then one pass of removals within the bound: about 0.6 of the triangles
  fitted,   ///< then moves heights within the bound, so that a second pass can remove more
};

struct GridTinOptions {
  /// The error bound, >= 0, in the unit of heights. Bounds below about 2^-45 of the height range
  /// cannot be distinguished from 0. See `max_error` of the result.
  double max_error = 0;
  TinQuality quality = TinQuality::removal;
  /// Signed distance on the ground from one column and one row to the next, in the same unit, not
  /// 0. East and north are positive, so row_step is negative if the first row is the northernmost.
  /// Angles and empty circles are measured on the ground, with the squares of the steps rounded to
  /// 1 / 1024 of the larger one. Triangles are counter-clockwise on the ground, seen from above.
  double column_step = 1;
  double row_step = -1;
  /// Measures the errors of the result. Not needed if the caller checks the written file.
  bool measure = true;
  /// Called for each vertex and each triangle that is measured.
  base::StopCheck check_stop{};
};

/// The vertices on the sides of a window: ascending sample numbers, including both ends.
struct GridSides {
  std::vector<std::uint32_t> first_row;
  std::vector<std::uint32_t> last_row;
  std::vector<std::uint32_t> first_column;
  std::vector<std::uint32_t> last_column;
};

struct GridVertex {
  std::uint32_t column = 0;
  std::uint32_t row = 0;
  double height =
      0;  ///< the sample's height, exact for T = float. With `fitted`, a value of type T

  bool operator==(const GridVertex&) const = default;
};

struct GridTin {
  std::vector<GridVertex> vertices;  ///< each in at least one triangle
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// The result of check_grid_tin(). Without `measure`, only the number of samples with data is
  /// set.
  GridTinCheck check;
};

/// Chooses the vertices on a side of a window, or on any line of samples. Simplifies the line to
/// within slightly less than `max_error`, greatest error first. Both ends are vertices.
/// `neighbour_line` and `other_neighbour_line` are the adjacent lines on either side. They have the
/// same length, or are empty where the raster ends (or has data everywhere). A sample with data is
/// a vertex if a neighbour on any of the three lines has no data. Both windows that share a side
/// must pass the same three lines. The order of the last two does not matter. Usually O(n log n).
///
/// Throws std::invalid_argument for lines of different lengths, heights beyond 1e150, and a bound
/// that is negative or NaN.
template <class T>
std::vector<std::uint32_t> settle_side(std::span<const T> line, std::span<const T> neighbour_line,
                                       std::span<const T> other_neighbour_line, double max_error);

/// Chooses the vertices on all four sides of a window without neighbours.
template <class T>
GridSides settle_sides(const GridWindow<T>& window, double max_error);

/// Builds a TIN with the vertices `sides` on its sides, within the bound at every sample that it
/// covers. T is float (which also holds integers of 24 bits) or double. A window of one row or
/// column has no triangles. Takes about a microsecond per vertex inserted (a third less with
/// `greedy`, half as much again with `fitted`). About twice as many vertices are inserted as
/// remain. Memory: about 190 bytes per vertex inserted, and 4 or 8 per sample (7 or 11 if data is
/// missing).
///
/// Deterministic: gives the same bytes on every processor.
///
/// Throws std::invalid_argument for a window without samples or with more than 65,535 columns or
/// rows, for `heights` of the wrong length, heights beyond 1e150, sides that do not ascend from end
/// to end, and options out of range. Lets exceptions of
/// options.check_stop pass.
template <class T>
GridTin grid_tin(const GridWindow<T>& window, const GridSides& sides,
                 const GridTinOptions& options);

/// Builds a TIN of at most `max_points` vertices, including the 4 corners, by inserting each vertex
/// where the error is greatest. The resulting error is `check.max_error` (with options.measure).
/// Insertion stops early once options.max_error is reached. options.quality is ignored. If there
/// are too few points to separate data from missing data, some samples with data remain uncovered
/// (check.uncovered_inner). Throws as grid_tin() does, and for max_points < 4.
template <class T>
GridTin grid_tin_of_points(const GridWindow<T>& window, std::size_t max_points,
                           const GridTinOptions& options);

/// Selects a small set of samples whose Delaunay triangulation is within the bound at all samples.
/// It is the triangulation of Delaunay2<std::int32_t> for points (column, row), so its ties are
/// broken as there. Returns the numbers of the selected samples, row by row, ascending.
///
/// The samples selected on the sides are those of `sides`, which must be within the bound at every
/// sample on them and separate data from gaps, as settle_side() does for this bound or a smaller
/// one. A triangle belongs to the surface if its three corners have data. It then contains no
/// sample without data and is within the bound at every sample in it. Every sample with data whose
/// 8 neighbours (those within the window) have data is in such a triangle. Selected samples without
/// data separate the surface from gaps.
///
/// If the selections of several windows are triangulated together, triangles next to a side whose
/// edges are not Delaunay edges of the whole differ, and may exceed the bound.
///
/// Inserts greedily, then removes vertices until each inner one is needed. Computes errors in
/// floats if T is float and they suffice, which is a tenth faster. Deterministic: gives the same
/// numbers on every processor. Takes one to a few microseconds per sample selected. Throws as
/// grid_tin() does. Calls check_stop for each vertex and lets its exceptions pass.
template <class T>
std::vector<std::uint32_t> select_samples(const GridWindow<T>& window, const GridSides& sides,
                                          double max_error, const base::StopCheck& check_stop = {});

extern template std::vector<std::uint32_t> settle_side(std::span<const float>,
                                                       std::span<const float>,
                                                       std::span<const float>, double);
extern template std::vector<std::uint32_t> settle_side(std::span<const double>,
                                                       std::span<const double>,
                                                       std::span<const double>, double);
extern template GridSides settle_sides(const GridWindow<float>&, double);
extern template GridSides settle_sides(const GridWindow<double>&, double);
extern template GridTin grid_tin(const GridWindow<float>&, const GridSides&, const GridTinOptions&);
extern template GridTin grid_tin(const GridWindow<double>&, const GridSides&,
                                 const GridTinOptions&);
extern template GridTin grid_tin_of_points(const GridWindow<float>&, std::size_t,
                                           const GridTinOptions&);
extern template GridTin grid_tin_of_points(const GridWindow<double>&, std::size_t,
                                           const GridTinOptions&);
extern template std::vector<std::uint32_t> select_samples(const GridWindow<float>&,
                                                          const GridSides&, double,
                                                          const base::StopCheck&);
extern template std::vector<std::uint32_t> select_samples(const GridWindow<double>&,
                                                          const GridSides&, double,
                                                          const base::StopCheck&);

}  // namespace terrace::tri
