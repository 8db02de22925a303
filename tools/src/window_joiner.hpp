// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "lattice_plan.hpp"
#include "mesh_spool.hpp"
#include "region.hpp"
#include "window_tin.hpp"

namespace terrace::tools {

/// Makes one mesh of the meshes of a plan's windows: a vertex on a side of several of them becomes
/// one vertex. Memory: 4 bytes per column of the raster, and the spool.
class WindowJoiner {
 public:
  /// With a region only the triangles that reach into it are taken, with their vertices.
  WindowJoiner(const LatticePlan& plan, const WindowMesher& mesher,
               const std::optional<Region>& region, MeshSpool& spool);

  /// Adds window i; windows come in order.
  void add(std::size_t i, const WindowTin& tin);

 private:
  [[nodiscard]] std::uint32_t* shared(const WindowTin& tin, const tri::GridVertex& vertex);

  const LatticePlan& plan_;
  const WindowMesher& mesher_;
  const std::optional<Region>& region_;
  MeshSpool& spool_;
  // Numbers of the vertices on the lines of sides above and below the row of windows at hand, and
  // on the left and right side of the window.
  std::vector<std::uint32_t> above_, below_, left_, right_;
};

}  // namespace terrace::tools
