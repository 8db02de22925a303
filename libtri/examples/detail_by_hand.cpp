// SPDX-License-Identifier: Apache-2.0
// Adds detail to a coarse grid in one place and removes it again. A consumer that sees only the
// changes keeps its own list of triangles.
#include <cstdio>
#include <cstdlib>
#include <set>

#include <terrace/tri/delaunay2.hpp>

int main() {
  using namespace terrace::tri;
  using Triangulation = Delaunay2<std::int32_t>;

  Triangulation terrain;
  terrain.start_journal();
  terrain.build_grid(0, 0, 64, 100, 100);  // every 64th sample of a raster
  const std::uint64_t coarse = terrain.hash();

  std::set<TriangleId> drawn;
  Triangulation::Changes changes;
  const auto update = [&] {
    terrain.take_changes(changes);
    for (const TriangleId t : changes.removed_triangles) drawn.erase(t);
    for (const TriangleId t : changes.added_triangles) drawn.insert(t);
    std::printf("%zu vertices, %zu triangles, %zu changed\n", terrain.vertex_count(), drawn.size(),
                changes.added_triangles.size());
    return drawn.size() == terrain.triangle_count();
  };
  bool correct = update();

  std::vector<Triangulation::Point> detail;
  for (std::int32_t y = 3000; y < 3100; y += 4)
    for (std::int32_t x = 3000; x < 3100; x += 4) detail.push_back({x, y});
  std::vector<Triangulation::Insertion> inserted(detail.size());
  terrain.insert(detail, inserted, terrain.nearest({3050, 3050}));
  correct = update() && correct;

  // Points that already existed stay.
  std::vector<VertexId> added;
  for (const auto& [vertex, created] : inserted)
    if (created) added.push_back(vertex);
  terrain.remove(std::span<const VertexId>(added));
  correct = update() && terrain.hash() == coarse && correct;
  return correct ? EXIT_SUCCESS : EXIT_FAILURE;
}
