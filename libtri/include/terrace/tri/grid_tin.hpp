// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// TINs of raster windows that are within a bound of every sample.
///
/// M. Garland, P. S. Heckbert, "Fast polygonal approximation of terrains and height fields",
/// CMU-CS-95-181 (greedy insertion), followed by the removal of vertices that later ones made
/// superfluous.
///
/// A large raster is cut into windows that share their sides: the last column of one is the first
/// of the next. What is on a side depends on the samples at that side alone (settle_side()), so the
/// windows fit together without cracks and may be made in any order, each by a thread of its own.
/// Nothing here keeps state or starts threads.
///
/// A TIN has no triangle that contains a sample without data, and every sample with data whose 8
/// neighbours have data too (as far as they are in the window) lies in a triangle. Between the two
/// the shore may run anywhere: land less than three samples wide can vanish.

namespace terrace::tri {

using Point3 = std::array<double, 3>;

/// Samples on a lattice, row by row. Heights that are not finite are no data.
template <class T>
struct GridWindow {
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  std::span<const T> heights;
};

struct GridTinCheck {
  double max_error = 0;  ///< vertically, over the covered samples
  double rms_error = 0;
  std::size_t samples = 0;                  ///< with data
  std::size_t covered = 0;                  ///< of these, in a triangle
  std::size_t uncovered = 0;                ///< of these, in none
  std::vector<std::uint32_t> uncovered_at;  ///< their numbers, row by row
  /// Uncovered samples whose 8 neighbours (as far as they are in the window) have data.
  std::size_t uncovered_inner = 0;
  std::size_t nodata_covered = 0;  ///< samples without data that are in a triangle
  std::size_t turned = 0;          ///< triangles without area or turned against the first one
};

/// Looks at every sample in every triangle, sides and corners included, in double. Points are
/// column, row and height, not necessarily on the lattice: the values that the reader of a file
/// gets back, which may have been rounded. `tolerance`, in cells, is how far they may have moved:
/// samples that are outside a triangle by no more count as covered by it, with its plane continued;
/// samples without data count only if they are inside. O(samples + triangles + points), memory for
/// one byte per sample and four per uncovered one.
///
/// Throws std::invalid_argument for `heights` of the wrong length, a corner that is not the number
/// of a point, a point that is not finite or (column, row) more than 2^20 away from the window, and
/// a tolerance that is not in [0, 1].
template <class T>
GridTinCheck check_grid_tin(const GridWindow<T>& window, std::span<const Point3> points,
                            std::span<const std::array<std::uint32_t, 3>> triangles,
                            double tolerance = 0);

extern template GridTinCheck check_grid_tin(const GridWindow<float>&, std::span<const Point3>,
                                            std::span<const std::array<std::uint32_t, 3>>, double);
extern template GridTinCheck check_grid_tin(const GridWindow<double>&, std::span<const Point3>,
                                            std::span<const std::array<std::uint32_t, 3>>, double);

/// How hard to look for fewer triangles of an error-bounded surface.
enum class TinQuality : std::uint8_t {
  kGreedy,   ///< insertion alone: a Delaunay triangulation of its vertices (but for settled sides)
  kRemoval,  ///< then one pass of removals that keep the error: about 0.6 of the triangles
  kFitted,   ///< then heights moved within the error, which opens room for a second pass
};

struct GridTinOptions {
  /// The bound, in the unit of heights. Not negative. Bounds below about 2^-45 of the range of
  /// heights are not told apart from 0, see `max_error` of the result.
  double max_error = 0;
  TinQuality quality = TinQuality::kRemoval;
  /// What one column and one row are on the ground, in one unit and not 0, with the direction:
  /// east and north are positive, so in rasters that begin in the north row_step is negative.
  /// Angles and empty circles are those on the ground, with squares of steps rounded to 1 / 1024 of
  /// the larger one. Triangles are counter-clockwise on the ground seen from above.
  double column_step = 1;
  double row_step = -1;
  /// Whether the result's errors are measured; a caller who checks what was written need not.
  bool measure = true;
};

/// The vertices on the sides of a window: ascending numbers of samples, both ends included.
struct GridSides {
  std::vector<std::uint32_t> first_row;
  std::vector<std::uint32_t> last_row;
  std::vector<std::uint32_t> first_column;
  std::vector<std::uint32_t> last_column;
};

struct GridVertex {
  std::uint32_t column = 0;
  std::uint32_t row = 0;
  double height = 0;  ///< the sample's, for T = float exactly; kFitted: one that a T can hold

  bool operator==(const GridVertex&) const = default;
};

struct GridTin {
  std::vector<GridVertex> vertices;  ///< those that are in a triangle
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// Errors against all samples that the mesh covers, by check_grid_tin(); without `measure` only
  /// the number of samples with data is set.
  GridTinCheck check;
};

/// The vertices on a side of a window, or on any line of samples. A line is simplified to within a
/// little less than `max_error`, the greatest error first; both ends are vertices. `beside` and
/// `other_beside` are the lines next to it, on either side and equally long, or empty where the
/// raster ends (or has data everywhere): a sample with data that has a neighbour without, on any of
/// the three, is a vertex. Both windows at a side must give the same three lines, in any order of
/// the latter two. O(n log n) as a rule.
///
/// Throws std::invalid_argument for lines of different lengths, heights beyond 1e150 and a bound
/// that is negative or not a number.
template <class T>
std::vector<std::uint32_t> settle_side(std::span<const T> line, std::span<const T> beside,
                                       std::span<const T> other_beside, double max_error);

/// All four of a window that has no neighbours.
template <class T>
GridSides settle_sides(const GridWindow<T>& window, double max_error);

/// A TIN whose vertices on the sides are `sides` and which is within the bound of every sample that
/// it covers. T is float (which holds integers of 24 bits too) or double. A window of one row or
/// column has no triangles. About a microsecond per vertex inserted (a third less for kGreedy, half
/// more for kFitted); memory for about 190 bytes per vertex inserted, about twice as many as
/// remain, and 4 or 8 (where data is missing 7 or 11) per sample.
///
/// Deterministic: the same bytes on every processor.
///
/// Throws std::invalid_argument for a window without samples or of more than 65,535 columns or
/// rows, for `heights` of the wrong length, heights beyond 1e150, sides that are not ascending from
/// end to end, and options out of range.
template <class T>
GridTin grid_tin(const GridWindow<T>& window, const GridSides& sides,
                 const GridTinOptions& options);

/// A TIN of at most `max_points` vertices, at least the 4 corners: each is inserted where the error
/// is greatest. Its error is `check.max_error` (options.measure). options.max_error is where to
/// stop earlier; options.quality does not matter. If there are too few points to separate data from
/// its lack, then samples with data remain uncovered (check.uncovered_inner). Throws as grid_tin(),
/// and for max_points < 4.
template <class T>
GridTin grid_tin_of_points(const GridWindow<T>& window, std::size_t max_points,
                           const GridTinOptions& options);

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

}  // namespace terrace::tri
