// SPDX-License-Identifier: Apache-2.0
// Adds detail to a coarse lattice of points in space in one place and removes it again. A consumer
// that sees only the changes keeps its own list of tetrahedra.
#include <cstdio>
#include <cstdlib>
#include <set>

#include <terrace/tri/delaunay3.hpp>

int main() {
  using namespace terrace::tri;
  using Triangulation = Delaunay3<std::int32_t>;

  std::vector<Triangulation::Point> coarse;
  for (std::int32_t z = 0; z < 10; ++z)
    for (std::int32_t y = 0; y < 10; ++y)
      for (std::int32_t x = 0; x < 10; ++x) coarse.push_back({x * 64, y * 64, z * 64});
  Triangulation space;
  space.start_journal();
  space.build(coarse);
  const std::uint64_t before = space.hash();

  std::set<TetrahedronId> drawn;
  Triangulation::Changes changes;
  const auto update = [&] {
    space.take_changes(changes);
    for (const TetrahedronId t : changes.removed_tetrahedra) drawn.erase(t);
    for (const TetrahedronId t : changes.added_tetrahedra) drawn.insert(t);
    std::printf("%zu vertices, %zu tetrahedra, %zu changed\n", space.vertex_count(), drawn.size(),
                changes.added_tetrahedra.size());
    return drawn.size() == space.tetrahedron_count();
  };
  bool correct = update();

  std::vector<Triangulation::Point> detail;
  for (std::int32_t z = 300; z < 340; z += 8)
    for (std::int32_t y = 300; y < 340; y += 8)
      for (std::int32_t x = 300; x < 340; x += 8) detail.push_back({x, y, z});
  std::vector<Triangulation::Insertion> inserted(detail.size());
  space.insert(detail, inserted, space.nearest({320, 320, 320}));
  correct = update() && correct;

  // Finds the tetrahedron that contains a point, and the nearest vertex.
  const Location3 location = space.locate({301, 302, 303});
  correct = correct && location.place != Place3::outside && space.alive(location.tetrahedron);

  // Points that already existed stay.
  std::vector<VertexId> added;
  for (const auto& [vertex, created] : inserted)
    if (created) added.push_back(vertex);
  space.remove(std::span<const VertexId>(added));
  correct = update() && space.hash() == before && correct;
  return correct ? EXIT_SUCCESS : EXIT_FAILURE;
}
