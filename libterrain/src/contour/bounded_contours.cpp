// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <terrace/base/ordered_work.hpp>

#include "base/store_checks.hpp"
#include "contour/levels.hpp"
#include "contour/parts.hpp"
#include "contour/triangles.hpp"
#include "surface/bounded/bounded_surface.hpp"
#include "surface/ground_slope.hpp"

namespace terrace::terrain {

void draw_bounded_contours(const ContourParts& parts) {
  using Triangle = ContourTriangles::Triangle;
  const ContourRequest& request = parts.request;
  const std::optional<Region>& region = request.region;
  need_bound_alone(request.level, request.focuses, request.max_edge);
  const GroundSlope ground(parts.store);
  if (region && !box_around(*region, ground).intersects(flat(parts.store.bounds()))) {
    throw_none_inside(parts.store);
  }
  if (parts.store.points() == 0) return;
  const auto surface = bounded_surface(parts.store, *request.max_error);
  const unsigned threads = surface->threads_within(parts.memory_bytes / 2, parts.threads);
  // Each window that meets the region is a part.
  std::vector<std::size_t> windows;
  for (std::size_t i = 0; i < surface->size(); ++i) {
    if (!region || reaches_into(surface->box(i), *region, ground)) windows.push_back(i);
  }
  const auto part_of = [&](std::size_t last_window) {
    const auto after = std::upper_bound(windows.begin(), windows.end(), last_window);
    return static_cast<std::uint32_t>(after - windows.begin() - 1);
  };
  const ContourLevels levels(request.interval);
  ContourTriangles lines(request.interval, parts.emit, parts.limit);
  base::in_order(
      windows.size(), threads,
      [&](unsigned, std::size_t i) {
        const BoundedPart mesh = surface->mesh(windows[i]);
        std::vector<ContourTriangles::Corner> corners;
        corners.reserve(mesh.vertices().size());
        for (std::uint32_t v = 0; v < mesh.vertices().size(); ++v) {
          const SurfaceCorner& vertex = mesh.vertices()[v];
          corners.push_back({vertex.place, vertex.height, levels.at_or_above(vertex.height),
                             part_of(mesh.last_window(v))});
        }
        std::vector<Triangle> crossed;
        for (const BoundedPart::Triangle& t : mesh.triangles()) {
          const Triangle triangle{corners[t[0]], corners[t[1]], corners[t[2]]};
          const auto& [a, b, c] = triangle;
          if (a.level == b.level && a.level == c.level) continue;
          const Point2 middle{(a.place[0] + b.place[0] + c.place[0]) / 3,
                              (a.place[1] + b.place[1] + c.place[1]) / 3};
          if (region && !region->covers(ground.world(middle))) continue;
          crossed.push_back(triangle);
        }
        ContourTriangles::sort(crossed);
        return crossed;
      },
      [&](std::size_t i, const std::vector<Triangle>& crossed) {
        lines.add(crossed);
        parts.progress(static_cast<double>(i + 1) / static_cast<double>(windows.size()));
      });
  lines.finish();
}

}  // namespace terrace::terrain
