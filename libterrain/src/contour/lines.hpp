// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "contour/levels.hpp"
#include "contour/line_joiner.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Exact contour lines (see ContourLevels) of the triangulated lattice (lattice_surface.hpp), in
/// columns and rows. With columns to the right and rows upwards, higher ground is on the left of a
/// line. Lines end at the border of the window and at samples without data.
///
/// The lattice is passed in bands of rows, from the first on, and lines continue from band to band.
/// Memory: the unfinished lines.
class ContourLines {
 public:
  /// Bands give the lines in the same order if their rows, except the first, are a divisor of this.
  static constexpr std::int64_t kMaxBandRows = 256;

  /// columns: number of columns of the lattice. emit: receives every line when it is complete, in
  /// an order that depends only on the lattice. Lines that shrink to a point are left out.
  ContourLines(std::int64_t columns, double interval, std::function<void(ContourLine&&)> emit,
               OpenLineLimit limit = {}, unsigned threads = 1);

  /// Adds the next band: `rows` rows of heights (NaN: no data), the first of which is the last of
  /// the previous band. wanted: whether to draw in the square right of and below (column, row) of
  /// the lattice. If it is empty, draws in all squares.
  void add(std::span<const double> heights, std::int64_t rows,
           const std::function<bool(std::int64_t column, std::int64_t row)>& wanted = {});
  /// Emits the lines that are still open. No bands may follow.
  void finish();

  /// Number of points of incomplete lines.
  [[nodiscard]] std::uint64_t open_points() const { return joiner_.open_points(); }
  /// Number of edges crossed by levels until now, each counted once per adjacent triangle.
  [[nodiscard]] std::uint64_t segments() const { return joiner_.segments(); }

 private:
  /// A level on an edge.
  struct Crossing {
    std::int64_t level = 0;
    std::uint64_t edge = 0;
    friend bool operator==(const Crossing&, const Crossing&) = default;
  };
  struct Hash {
    std::size_t operator()(const Crossing& c) const;
  };
  struct Corner {
    std::int64_t column = 0, row = 0;
    double height = 0;
    std::int64_t level = 0;  ///< from ContourLevels::at_or_above()
  };

  [[nodiscard]] Crossing crossing(std::int64_t level, const Corner& a, const Corner& b) const;
  [[nodiscard]] Point2 place(std::int64_t level, const Corner& a, const Corner& b) const;
  void triangle(const Corner& a, const Corner& b, const Corner& c);
  /// Fills levels_ and crossed_ with all threads.
  void find_crossed(std::span<const double> heights, std::int64_t rows);
  void emit_complete(std::int64_t last_row, bool all);

  std::int64_t columns_;
  ContourLevels contour_levels_;
  LineJoiner<Crossing, Hash> joiner_;
  std::int64_t row_ = 0;  ///< number of the next band's first row
  std::vector<std::int64_t> levels_;
  std::vector<std::vector<std::uint32_t>>
      crossed_;  ///< by row of the band: columns of squares that levels may cross
  unsigned threads_;
};

}  // namespace terrace::terrain
