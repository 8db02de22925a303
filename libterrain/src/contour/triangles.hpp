// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "contour/levels.hpp"
#include "contour/line_joiner.hpp"
#include "contour/part_lines.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Exact contour lines (see ContourLevels) of a triangulation, in the coordinates of its vertices.
/// Higher ground is on the left of a line if the second coordinate points upwards. Lines end at
/// hull edges and at triangles that are left out.
///
/// The triangles are passed in parts 0, 1, ... in this order. Each corner names a part, after which
/// no edge at it has a triangle that was not passed. So either vertices have one part each, and
/// each triangle comes with the first part that has one of its vertices, or at the end if no part
/// has. Or parts share vertices, and a corner names the last part that has it. The lines at an edge
/// are complete when the first part that its ends name is. Memory: the unfinished lines.
class ContourTriangles {
 public:
  struct Corner {
    Point2 place{};
    double height = 0;
    std::int64_t level = 0;  ///< from ContourLevels::at_or_above()
    std::uint32_t part = kNoContourPart;
  };
  using Triangle = std::array<Corner, 3>;  ///< counter-clockwise

  /// emit: receives every line when it is complete, in an order that depends only on the order of
  /// the triangles. Lines that shrink to a point are left out. by_rows: as in ContourLevels.
  ContourTriangles(double interval, std::function<void(ContourLine&&)> emit,
                   OpenLineLimit limit = {}, bool by_rows = false);

  /// Adds the triangles of the next part; triangles that no level crosses may be left out.
  void add(std::span<const Triangle> triangles);
  /// The same for triangles sorted as in sort().
  void add(const PartLines& part);
  /// Adds the triangles that belong to no part; must be the last call.
  void finish(std::span<const Triangle> triangles = {});

  /// Sorts the triangles of a part into the order in which to add them, which depends only on their
  /// places. Rotates each triangle so that its smallest corner is first.
  static void sort(std::span<Triangle> triangles);

  /// Number of points of incomplete lines.
  [[nodiscard]] std::uint64_t open_points() const { return joiner_.open_points(); }
  /// Number of edges crossed by levels until now, each counted once per adjacent triangle.
  [[nodiscard]] std::uint64_t segments() const { return joiner_.segments(); }

 private:
  struct Hash {
    std::size_t operator()(const ContourCrossing& c) const;
  };

  void join(std::span<const Triangle> triangles);
  void end_part();

  ContourLevels levels_;
  LineJoiner<ContourCrossing, Hash> joiner_;
  std::uint32_t part_ = 0;  ///< the next one
};

}  // namespace terrace::terrain
