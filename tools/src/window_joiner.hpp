// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "lattice_plan.hpp"
#include "mesh_spool.hpp"
#include "window_tin.hpp"

namespace terrace::tools {

/// Makes one mesh of the meshes of a plan's windows: a vertex on a side of several of them becomes
/// one vertex. Memory: 4 bytes per column of the raster, and the spool.
class WindowJoiner {
 public:
  WindowJoiner(const LatticePlan& plan, MeshSpool& spool);

  /// Adds window i; windows come in order.
  void add(std::size_t i, WindowTin&& tin);

 private:
  [[nodiscard]] std::uint32_t* shared(const WindowTin& tin, const tri::GridVertex& vertex);

  const LatticePlan& plan_;
  MeshSpool& spool_;
  // Numbers of the vertices on the lines of sides above and below the row of windows at hand, and
  // on the left and right side of the window.
  std::vector<std::uint32_t> above_, below_, left_, right_;
};

}  // namespace terrace::tools
