// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mesh.hpp"
#include "terrace/tri/delaunay3.hpp"

namespace terrace::tri::spatial {

constexpr std::array<VertexId, 4> vertex_ids(const std::array<std::uint32_t, 4>& corner) {
  return {VertexId{corner[0]}, VertexId{corner[1]}, VertexId{corner[2]}, VertexId{corner[3]}};
}

/// Turns the journal's records into net changes and empties it. Changes: that of a Delaunay3.
template <class Kernel, class Changes>
void take_changes(Mesh<Kernel>& mesh, Changes& changes) {
  changes.clear();
  auto& journal = mesh.journal;
  for (const auto& record : journal.vertices()) {
    const bool now = mesh.vertex_alive(record.slot);
    if (record.was_alive && now && record.before == mesh.vertex[record.slot].point) {
      // The same again; so its tetrahedra may be the same as well.
      journal.forget_vertex(record.slot);
      continue;
    }
    if (record.was_alive) {
      changes.removed_vertices.push_back(VertexId{record.slot});
      changes.removed_points.push_back(record.before);
    }
    if (now) changes.added_vertices.push_back(VertexId{record.slot});
  }
  const auto of_same_vertices = [&](const std::array<std::uint32_t, 4>& corner) {
    for (const std::uint32_t v : corner)
      if (journal.vertex_touched(v)) return false;
    return true;
  };
  for (const auto& record : journal.cells()) {
    const bool before = is_finite(record.before);
    const bool now = mesh.tetrahedron_alive(record.slot);
    if (before && now && record.before == mesh.tetrahedron[record.slot].corner &&
        of_same_vertices(record.before))
      continue;
    if (before) {
      changes.removed_tetrahedra.push_back(TetrahedronId{record.slot});
      changes.removed_corners.push_back(vertex_ids(record.before));
    }
    if (now) changes.added_tetrahedra.push_back(TetrahedronId{record.slot});
  }
  journal.clear();
}

}  // namespace terrace::tri::spatial
