// SPDX-License-Identifier: Apache-2.0
// A hill on scattered points: heights, slopes and aspects at query points, a smoothed version as an
// overlay, and mesh quality.
#include <cmath>
#include <cstdio>
#include <vector>

#include "terrace/tri/interpolation.hpp"
#include "terrace/tri/quality.hpp"
#include "terrace/tri/smoothing.hpp"

namespace tri = terrace::tri;

int main() {
  // 40 x 40 points, slightly off a grid, and a cone of slope 1 / 2 with its top at (200, 200).
  std::vector<std::array<std::int32_t, 2>> points;
  for (std::int32_t y = 0; y < 40; ++y)
    for (std::int32_t x = 0; x < 40; ++x)
      points.push_back({10 * x + (7 * y) % 5, 10 * y + (3 * x) % 7});
  tri::Delaunay2<std::int32_t> terrain;
  terrain.build(points);
  std::vector<double> heights(terrain.vertex_slots());  // by slot
  for (const tri::VertexId v : terrain.all_vertices()) {
    const auto [x, y] = terrain.point(v);
    heights[slot(v)] = 100 - 0.5 * std::hypot(x - 200, y - 200);
  }

  // Passes many queries in one call: heights, and slope and aspect.
  const std::vector<tri::Point2> queries{{200, 120.5}, {280.25, 200}, {-50, 0}};
  const auto found =
      tri::heights_at(terrain, heights, queries, tri::Interpolation::natural_neighbour);
  const auto gradients =
      tri::gradients_at(terrain, heights, queries, tri::GradientFrom::natural_neighbours);
  for (std::size_t i = 0; i < 2; ++i)
    std::printf("(%g, %g): height %.2f, slope %.1f degrees, facing %.0f degrees\n", queries[i][0],
                queries[i][1], found[i], tri::slope_degrees(gradients[i]),
                tri::aspect_degrees(gradients[i]));

  if (std::isnan(found[2])) std::printf("(-50, 0) is outside the hull\n");

  // Rounds off the top: new heights for the vertices in a window, except those on its border.
  tri::SmoothingOptions options;
  options.iterations = 20;
  const auto window = tri::vertices_in(terrain, tri::box2(150, 150, 250, 250));
  const auto overlay = tri::smooth(terrain, heights, window, options);
  std::vector<double> rounded = heights;
  for (const auto& [vertex, height] : overlay) rounded[slot(vertex)] = height;

  const tri::MeshQuality before = tri::mesh_quality(terrain, heights, 50);
  const tri::MeshQuality after = tri::mesh_quality(terrain, rounded, 50);
  std::printf("smallest angle %.1f degrees, edges %.1f to %.1f, area %.0f\n",
              before.min_angle_degrees, before.min_edge, before.max_edge, before.area);
  std::printf("above a height of 50: %.0f, and %.0f with %zu vertices smoothed\n",
              before.volume_above, after.volume_above, overlay.size());

  // Compares the mesh with the cone itself, between its points.
  std::vector<tri::Point3> others;
  for (int i = 20; i < 380; i += 3)
    others.push_back({i + 0.5, 400.0 - i, 100 - 0.5 * std::hypot(i + 0.5 - 200, 200.0 - i)});
  const tri::VerticalDistances d = tri::vertical_distances(terrain, heights, others);
  std::printf("%zu points not in the mesh: at most %.2f off, rms %.2f\n", d.count, d.max, d.rms);

  const bool right = std::abs(found[0] - 60.25) < 0.5 && std::isnan(found[2]) &&
                     std::abs(tri::slope_degrees(gradients[1]) - 26.57) < 2 &&
                     std::abs(tri::aspect_degrees(gradients[1]) - 90) < 5 &&
                     after.volume_above < before.volume_above && d.max < 2.5;
  return right ? 0 : 1;
}
