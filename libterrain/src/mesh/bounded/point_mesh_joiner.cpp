// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/point_mesh_joiner.hpp"

#include <algorithm>

namespace terrace::terrain {

PointMeshJoiner::PointMeshJoiner(const PointMeshPlan& plan, PointMeshSides& sides, MeshSpool& spool)
    : plan_(plan), sides_(sides), spool_(spool), knots_(plan.knots.size(), kNoNumber) {}

void PointMeshJoiner::add(std::size_t i, const PointWindowTin& tin) {
  std::vector<std::uint32_t> numbers;
  numbers.reserve(tin.vertices.size());
  for (std::size_t v = 0; v < tin.vertices.size(); ++v) {
    std::uint32_t own = kNoNumber;
    std::uint32_t* known = &own;
    if (v < tin.shared.size()) {
      const PointWindowTin::Shared& shared = tin.shared[v];
      if (shared.knot != kNoNumber) {
        known = &knots_[shared.knot];
      } else if (shared.side != kNoNumber) {
        std::vector<std::uint32_t>& side = open_sides_[shared.side];
        if (side.size() <= shared.place) side.resize(shared.place + 1, kNoNumber);
        known = &side[shared.place];
      }
    }
    if (*known == kNoNumber) {
      *known = static_cast<std::uint32_t>(spool_.vertices());
      spool_.add_vertex(tin.vertices[v]);
    }
    numbers.push_back(*known);
  }
  for (const auto& t : tin.triangles) {
    spool_.add_triangle({numbers[t[0]], numbers[t[1]], numbers[t[2]]});
  }
  for (const std::uint32_t side : plan_.windows[i].sides) {
    // The later of its two windows closes it.
    if (std::max(plan_.sides[side].windows[0], plan_.sides[side].windows[1]) != i) continue;
    open_sides_.erase(side);
    sides_.drop(side);
  }
}

}  // namespace terrace::terrain
