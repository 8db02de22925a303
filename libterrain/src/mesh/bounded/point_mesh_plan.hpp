// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "mesh/bounded/point_mesh_cuts.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// How the region of irregular samples, their convex hull, is cut into windows that are meshed one
/// by one. Each is a cell, or several together that make a rectangle, cut with the hull: convex. No
/// window reaches over a cut line, but one may end within another's side.
struct PointMeshPlan {
  /// Where a cut line ends, at the hull or at another cut line.
  struct Knot {
    Point2 place{};
    bool at_hull = false;
  };
  /// A stretch of a cut line between two knots, with one window on either side.
  struct Side {
    unsigned axis = 0;  ///< 0: of points of equal x
    double line = 0.0;
    std::array<std::uint32_t, 2> knots{};    ///< the lower first
    std::array<std::uint32_t, 2> windows{};  ///< that of smaller coordinates first
  };
  struct Window {
    PlaneBox box;
    std::uint32_t first_cell = 0, cells = 0;
    double samples = 0.0;              ///< about
    double spacing = 0.0;              ///< about the distance of neighbours
    std::vector<std::uint32_t> sides;  ///< inside the hull
    std::vector<Point2> corners;       ///< of the hull
  };
  std::vector<Knot> knots;
  std::vector<Side> sides;
  std::vector<Window> windows;  ///< in the order of their cells
};

/// hull: of all samples, with an area. together(first, cells): whether these cells, which are all
/// of one node, shall be one window.
PointMeshPlan plan_point_mesh(
    const PointMeshCuts& cuts, std::span<const Point2> hull,
    const std::function<bool(std::uint32_t first, std::uint32_t cells)>& together);

}  // namespace terrace::terrain
