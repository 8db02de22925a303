// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "mesh/bounded/lattice_plan.hpp"
#include "mesh/bounded/mesh_spool.hpp"
#include "mesh/bounded/window_tin.hpp"

namespace terrace::terrain {

/// Makes one mesh of the meshes of a plan's windows: a vertex on a side of several of them becomes
/// one vertex. Memory: 4 bytes per column of the raster, samples on sides beside cells without
/// data, and the spool.
class WindowJoiner {
 public:
  WindowJoiner(const LatticePlan& plan, MeshSpool& spool);

  /// Adds window i; windows come in order.
  void add(std::size_t i, WindowTin&& tin);
  /// Samples that lie on no triangle of any window.
  [[nodiscard]] std::uint64_t uncovered() const { return uncovered_; }

 private:
  void count_uncovered(const WindowTin& tin);
  [[nodiscard]] std::uint32_t* shared(const WindowTin& tin, const tri::GridVertex& vertex);

  const LatticePlan& plan_;
  MeshSpool& spool_;
  // Numbers of the vertices on the lines of sides above and below the row of windows at hand, and
  // on the left and right side of the window.
  std::vector<std::uint32_t> above_, below_, left_, right_;
  std::uint64_t uncovered_ = 0;
  /// By row and column, how many windows did not cover a sample on their sides: it is uncovered if
  /// all did not that have it.
  std::map<std::pair<std::int64_t, std::int64_t>, unsigned> on_sides_;
};

}  // namespace terrace::terrain
