// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <terrace/tri/point_tin.hpp>

#include "surface/bounded/point_mesh_cells.hpp"
#include "surface/window_sides.hpp"
#include "terrace/terrain/region.hpp"

/// Windows of irregular samples, and the vertices on their sides.

namespace terrace::terrain {

/// The division of the region of irregular samples, their convex hull, into windows that are meshed
/// one by one. A window is a rectangle of one or more cells, clipped to the hull, so it is convex.
/// Cut lines separate windows. A corner of one window may be in the middle of another's side (a
/// T-junction).
struct PointMeshPlan {
  /// A point where a cut line ends, at the hull or at another cut line.
  struct Junction {
    Point2 position{};
    bool at_hull = false;  ///< and only one side ends here
    /// The highest number of a window that uses this junction. After it, the junction can be
    /// dropped.
    std::uint32_t last_window = 0;
  };
  /// A part of a cut line between two junctions, with one window on each side.
  struct Side {
    unsigned axis = 0;  ///< 0: on a line of constant x, 1: of constant y
    double coordinate = 0.0;
    std::array<std::uint32_t, 2> junctions{};  ///< the lower first
    std::array<std::uint32_t, 2> windows{};    ///< the one with smaller coordinates first

    [[nodiscard]] std::uint32_t last_window() const { return std::max(windows[0], windows[1]); }
  };
  struct Window {
    PlaneBox box;
    std::uint32_t first_cell = 0, cells = 0;
    double samples = 0.0;              ///< approximate
    double spacing = 0.0;              ///< approximate distance between neighbouring samples
    std::vector<std::uint32_t> sides;  ///< inside the hull
    std::vector<Point2> hull_corners;  ///< hull vertices inside the window
  };
  std::vector<Junction> junctions;
  std::vector<Side> sides;
  std::vector<Window> windows;  ///< in the order of their cells
};

/// Divides the hull into windows. hull: the convex hull of all samples, with positive area.
/// merge(first, cells): whether this run of cells, the leaves of one node, becomes one window.
PointMeshPlan plan_point_mesh(
    const PointMeshCuts& cuts, std::span<const Point2> hull,
    const std::function<bool(std::uint32_t first, std::uint32_t cells)>& merge);

/// The vertices on the sides of windows, computed before the windows are meshed: the Delaunay
/// triangulation of the samples close to a side is intersected with it and simplified within a
/// fixed share of the error bound. The result depends only on these samples, so both windows get
/// the same vertices, and the mesh has no cracks. Thread-safe.
class PointMeshSides {
 public:
  /// max_error: error bound of the mesh, in the unit of heights. max_kept: of vertices, as in
  /// WindowSides.
  PointMeshSides(const PointMeshPlan& plan, ReadCells read, tri::PointDuplicates duplicates,
                 double max_error, std::size_t max_kept = std::numeric_limits<std::size_t>::max());

  /// Returns the vertices of a side, ascending, with its junctions. Keeps them until drop().
  std::shared_ptr<const SideVertices> vertices(std::uint32_t side) {
    return cache_.vertices(side, [&] { return compute_vertices(plan_.sides[side]); });
  }
  /// Drops the vertices of a side that no window needs any more.
  void drop(std::uint32_t side) { cache_.drop(side); }

 private:
  [[nodiscard]] SideVertices compute_vertices(const PointMeshPlan::Side& side);
  [[nodiscard]] MeshSamples near_side(const PointMeshPlan::Side& side) const;
  [[nodiscard]] double height_at(std::uint32_t junction);
  [[nodiscard]] double compute_height(std::uint32_t junction) const;

  const PointMeshPlan& plan_;
  ReadCells read_;
  tri::PointDuplicates duplicates_;
  double side_error_;
  std::vector<std::vector<std::uint32_t>> windows_by_junction_;
  WindowSides<std::uint32_t> cache_;
  std::mutex mutex_;                            ///< protects heights_
  std::vector<std::optional<double>> heights_;  ///< by junction
};

}  // namespace terrace::terrain
