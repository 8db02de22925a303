// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <terrace/tri/point_tin.hpp>

#include "mesh/bounded/point_mesh_cells.hpp"
#include "surface/window_sides.hpp"
#include "terrace/terrain/region.hpp"

/// The windows of irregular samples, and the vertices on their sides.

namespace terrace::terrain {

/// The division of the region of irregular samples, their convex hull, into windows that are meshed
/// one by one. A window is a cell, or several that form a rectangle, intersected with the hull, so
/// it is convex. No window crosses a cut line, but one may end within another's side.
struct PointMeshPlan {
  /// The end of a cut line, at the hull or at another cut line.
  struct Knot {
    Point2 place{};
    bool at_hull = false;
    std::uint32_t last = 0;  ///< the last window with a side that ends here
  };
  /// A part of a cut line between two knots, with one window on each side.
  struct Side {
    unsigned axis = 0;  ///< 0: points of equal x
    double line = 0.0;
    std::array<std::uint32_t, 2> knots{};    ///< the lower first
    std::array<std::uint32_t, 2> windows{};  ///< the one with smaller coordinates first

    [[nodiscard]] std::uint32_t last() const { return std::max(windows[0], windows[1]); }
  };
  struct Window {
    PlaneBox box;
    std::uint32_t first_cell = 0, cells = 0;
    double samples = 0.0;              ///< approximate
    double spacing = 0.0;              ///< approximate distance of neighbours
    std::vector<std::uint32_t> sides;  ///< inside the hull
    std::vector<Point2> corners;       ///< of the hull
  };
  std::vector<Knot> knots;
  std::vector<Side> sides;
  std::vector<Window> windows;  ///< in the order of their cells
};

/// hull: of all samples, with positive area. together(first, cells) returns whether these cells,
/// all of one node, should be one window.
PointMeshPlan plan_point_mesh(
    const PointMeshCuts& cuts, std::span<const Point2> hull,
    const std::function<bool(std::uint32_t first, std::uint32_t cells)>& together);

/// The vertices on the sides of windows, computed before the windows are meshed: the Delaunay
/// triangulation of the samples close to a side, intersected with it, within a share of the bound.
/// It depends only on these samples, so both windows at a side have the same vertices there.
/// Thread-safe.
class PointMeshSides {
 public:
  /// max_error: of the mesh, in the unit of heights.
  PointMeshSides(const PointMeshPlan& plan, PointMeshSamples& samples,
                 tri::PointDuplicates duplicates, double max_error);

  /// Returns the vertices of a side, its knots included, ascending. Kept until drop().
  std::shared_ptr<const SideVertices> vertices(std::uint32_t side) {
    return known_.vertices(side, [&] { return settle(plan_.sides[side]); });
  }
  void drop(std::uint32_t side) { known_.drop(side); }

 private:
  [[nodiscard]] SideVertices settle(const PointMeshPlan::Side& side);
  [[nodiscard]] MeshSamples near_side(const PointMeshPlan::Side& side) const;
  [[nodiscard]] double height_at(std::uint32_t knot);
  [[nodiscard]] double settle_knot(std::uint32_t knot) const;

  const PointMeshPlan& plan_;
  PointMeshSamples& samples_;
  tri::PointDuplicates duplicates_;
  double side_error_;
  std::vector<std::vector<std::uint32_t>> windows_at_;  ///< per knot
  WindowSides<std::uint32_t> known_;
  std::mutex mutex_;                            ///< for heights_
  std::vector<std::optional<double>> heights_;  ///< of knots
};

}  // namespace terrace::terrain
