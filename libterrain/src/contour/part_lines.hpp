// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/tri/delaunay2.hpp>

#include "contour/levels.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The part number of vertices that are in no part.
inline constexpr std::uint32_t kNoContourPart = 0xFFFFFFFFu;

/// A level on the edge between two places.
struct ContourCrossing {
  std::int64_t level = 0;
  Point2 a{}, b{};                      ///< a < b
  std::uint32_t last = kNoContourPart;  ///< the last part that may have a triangle at the edge

  ContourCrossing() = default;
  ContourCrossing(std::int64_t at, const Point2& p, const Point2& q, std::uint32_t part)
      : level(at), a(p < q ? p : q), b(p < q ? q : p), last(part) {}
  friend bool operator==(const ContourCrossing& p, const ContourCrossing& q) {
    return p.level == q.level && p.a == q.a && p.b == q.b;
  }
};

/// The contour lines of one part of a triangulation (see ContourTriangles), cut where they leave
/// the part. Their segments have the order of the triangles as in ContourTriangles::sort(), and of
/// the levels within a triangle.
struct PartLines {
  static constexpr std::uint32_t kClosed = 0xFFFFFFFFu;
  struct Line {
    std::int64_t level = 0;
    std::size_t begin = 0, end = 0;  ///< range of points; closed lines end where they begin
    std::uint32_t open = kClosed;    ///< or its number in `open`
  };
  /// The members of a LineStretch.
  struct Open {
    ContourCrossing from, to;
    std::uint32_t number = 0;
    std::size_t last = 0;
  };
  std::vector<Line> lines;  ///< by their last segments
  std::vector<Open> open;
  std::vector<Point2> points;
};

/// Follows the lines of parts from triangle to triangle.
class PartTracer {
 public:
  /// A triangulation and, by vertex slot, heights, their ContourLevels::at_or_above(), and parts.
  /// They must outlive the object.
  PartTracer(const ContourLevels& levels, const tri::Delaunay2<double>& triangulation,
             std::span<const double> heights, std::span<const std::int64_t> level_of,
             std::span<const std::uint32_t> part_of)
      : levels_(levels),
        triangulation_(triangulation),
        heights_(heights),
        level_of_(level_of),
        part_of_(part_of),
        number_of_(triangulation.triangle_slots(), kNone) {}

  /// Returns the lines of a part, given its triangles, each crossed by a level. About 50 ns per
  /// segment.
  PartLines trace(std::span<const tri::TriangleId> triangles);

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  struct Entry {
    std::int64_t low = 0;        ///< the lowest level that crosses it
    std::size_t first = 0;       ///< index of its first level in done_
    std::uint32_t smallest = 0;  ///< corner
  };
  /// The first and the last segment of a line, by their triangles.
  struct Ends {
    std::uint32_t line = 0;
    std::int64_t level = 0;
    std::uint32_t first = 0, last = 0;   ///< entries
    Point2 first_place{}, last_place{};  ///< smallest corners of these
    std::ptrdiff_t last_at = 0;          ///< position of `last` from the start, forwards
  };

  void follow(std::uint32_t start, std::int64_t level, PartLines& lines);
  /// Continues from a segment until the line leaves the part or returns to `start`. Marks the
  /// segments that it passes and appends their ends. Returns whether it came back to `start`.
  bool go(std::uint32_t start, std::int64_t level, bool forwards, Ends& ends,
          std::vector<Point2>& points, ContourCrossing& end);
  void count(std::uint32_t entry, std::ptrdiff_t at, Ends& ends) const;
  [[nodiscard]] Point2 place(std::uint32_t entry, std::size_t corner) const;
  /// The order of two entries; `places`: of their smallest corners.
  [[nodiscard]] bool is_before(std::uint32_t s, const Point2& s_place, std::uint32_t t,
                               const Point2& t_place) const;

  const ContourLevels& levels_;
  const tri::Delaunay2<double>& triangulation_;
  std::span<const double> heights_;
  std::span<const std::int64_t> level_of_;
  std::span<const std::uint32_t> part_of_;
  std::vector<std::uint32_t> number_of_;  ///< index of the entry, by triangle slot
  std::span<const tri::TriangleId> triangles_;
  std::vector<Entry> entries_;  ///< one entry for each of triangles_
  std::vector<bool> done_;      ///< by segment
  std::vector<Ends> ends_;
  std::vector<Point2> forwards_, backwards_;
};

}  // namespace terrace::terrain
