// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <span>
#include <unordered_map>
#include <vector>

#include "region.hpp"

namespace terrace::tools {

/// A contour line in columns and rows; closed ones end where they begin.
struct ContourLine {
  std::int64_t level = 0;  ///< its height is level times the interval
  bool closed = false;
  std::vector<Point2> points;
};

/// Contour lines of the triangulated lattice (lattice_surface.hpp), exactly: a lattice edge, or a
/// diagonal of a square, is crossed by a level if one end lies above it and the other does not. So
/// a sample at a level counts as below it, plateaus have a line around their upper side only, and
/// each triangle that a level crosses has one segment of it. Higher ground is on the same side all
/// along a line. Lines end at the border of the window and at samples without data.
///
/// The lattice comes in bands of rows from the first on; lines go on from band to band. Memory: the
/// lines that are not at their ends.
class ContourLines {
 public:
  /// columns: of the lattice. emit: takes every line once it is whole, in an order that depends on
  /// the lattice alone. Lines that shrink to a point are left out.
  ContourLines(std::int64_t columns, double interval, std::function<void(const ContourLine&)> emit);

  /// The next band: `rows` rows of heights (NaN: no data), of which the first is the last of the
  /// band before. wanted: whether the square right of and below (column, row) of the lattice
  /// counts; may be empty: all do.
  void add(std::span<const double> heights, std::int64_t rows,
           const std::function<bool(std::int64_t column, std::int64_t row)>& wanted = {});
  /// Emits what is still open: nothing follows.
  void finish();

  /// Points of lines that are not whole yet.
  [[nodiscard]] std::uint64_t open_points() const { return open_points_; }
  /// Edges crossed by levels so far, each counted once per triangle at it.
  [[nodiscard]] std::uint64_t segments() const { return segments_; }

 private:
  /// A level on an edge: where a segment begins or ends.
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
    std::int64_t level = 0;  ///< the lowest level that is not below it
  };
  struct Line {
    Crossing begin, end;
    std::deque<Point2> points;
  };

  [[nodiscard]] std::int64_t level_of(double height) const;
  [[nodiscard]] Crossing crossing(std::int64_t level, const Corner& a, const Corner& b) const;
  [[nodiscard]] Point2 place(std::int64_t level, const Corner& a, const Corner& b) const;
  void triangle(const Corner& a, const Corner& b, const Corner& c);
  void segment(const Crossing& from, Point2 from_place, const Crossing& to, Point2 to_place);
  void emit_whole(std::int64_t last_row, bool all);
  void emit(Line& line, bool closed);

  std::int64_t columns_;
  double interval_;
  std::function<void(const ContourLine&)> emit_;
  std::int64_t row_ = 0;  ///< of the next band's first row
  std::uint64_t open_points_ = 0, segments_ = 0, next_line_ = 0;
  std::map<std::uint64_t, Line> lines_;  ///< by number: an order that does not depend on hashing
  std::unordered_map<Crossing, std::uint64_t, Hash> begins_, ends_;
  std::vector<std::int64_t> levels_;
};

}  // namespace terrace::tools
