// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "contour/contour_levels.hpp"
#include "contour/line_joiner.hpp"
#include "contour/part_lines.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Contour lines of a triangulation, in the coordinates of its vertices, exactly (see
/// ContourLevels). Higher ground is on the left of a line where the second coordinate grows
/// upwards. Lines end at hull edges and at triangles that are left out.
///
/// The triangles come in parts: part 0, 1, ... in this order, each triangle in the first part that
/// has one of its vertices, or at the end if no part has. So what lies at an edge is known when the
/// first part of one of its ends is. Memory: the lines that are not at their ends.
class ContourTriangles {
 public:
  struct Corner {
    Point2 place{};
    double height = 0;
    std::int64_t level = 0;  ///< ContourLevels::at_or_above
    std::uint32_t part = kNoContourPart;
  };
  using Triangle = std::array<Corner, 3>;  ///< counter-clockwise

  /// emit: takes every line once it is whole, in an order that depends on that of the triangles
  /// alone. Lines that shrink to a point are left out.
  ContourTriangles(double interval, std::function<void(ContourLine&&)> emit,
                   OpenLineLimit limit = {});

  /// The triangles of the next part; those that no level crosses may be left out.
  void add(std::span<const Triangle> triangles);
  /// The same, of the triangles sorted as sort() does.
  void add(const PartLines& part);
  /// Those of no part; nothing follows.
  void finish(std::span<const Triangle> triangles = {});

  /// The order in which the triangles of a part are to be added: such that it depends on their
  /// places alone. Each triangle is turned so that its smallest corner comes first.
  static void sort(std::span<Triangle> triangles);

  /// Points of lines that are not whole yet.
  [[nodiscard]] std::uint64_t open_points() const { return joiner_.open_points(); }
  /// Edges crossed by levels so far, each counted once per triangle at it.
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
