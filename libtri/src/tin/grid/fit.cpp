// SPDX-License-Identifier: Apache-2.0
#include <limits>

#include "careful.hpp"
#include "surface.hpp"

namespace terrace::tri::tin {

template <class T>
void GridSurface<T>::fit() {
  const std::vector<std::uint32_t> triangle_of = triangle_of_vertices(triangles_, corners_.size());
  for (std::uint32_t vertex = 0; vertex < corners_.size(); ++vertex) {
    const Corner& own = corners_[vertex];
    if (triangle_of[vertex] != kNone && own.x != 0 && own.y != 0 && own.x != columns_ - 1 &&
        own.y != rows_ - 1 && sees(own))
      fit_vertex(vertex, triangle_of[vertex]);
  }
}

/// A sample of which the vertex has part w of the weights allows it to rise by (error - bound) / w
/// to (error + bound) / w. Vertices that are left no interval stay where they are, and so do those
/// of triangles whose errors are too uncertain.
template <class T>
void GridSurface<T>::fit_vertex(std::uint32_t vertex, std::uint32_t first) {
  double lowest = -std::numeric_limits<double>::infinity(), highest = -lowest;
  Corner& own = corners_[vertex];
  std::uint32_t t = first;
  do {
    const Triangle& triangle = triangles_[t];
    const unsigned at = corner_of(triangle, vertex);
    const Corner &b = corner(triangle, after(at)), &c = corner(triangle, before(at));
    t = triangle.next[after(at)];
    if (!sees(b) || !sees(c)) continue;
    const auto area = static_cast<double>(turn(own, b, c));
    const double bz = static_cast<double>(b.z) - static_cast<double>(own.z);
    const double cz = static_cast<double>(c.z) - static_cast<double>(own.z);
    const double allowed = bound_ * (1 - 0x1p-20) - 0x1p-40 * (std::fabs(bz) + std::fabs(cz));
    visit_rows(own, b, c, [&](std::int32_t y, std::int32_t from, std::int32_t to) {
      const T* const row = heights_.data() + static_cast<std::size_t>(y) * samples_.stride;
      for (std::int32_t x = from; x <= to; ++x) {
        const Corner p{x, y, T{}};
        const auto weight = static_cast<double>(turn(p, b, c));
        if (weight == 0) continue;
        const double rise = (bz * static_cast<double>(turn(own, p, c)) +
                             cz * static_cast<double>(turn(own, b, p))) /
                            area;
        const double error = static_cast<double>(row[x]) - static_cast<double>(own.z) - rise;
        const double part = area / weight;
        lowest = std::max(lowest, (error - allowed) * part);
        highest = std::min(highest, (error + allowed) * part);
      }
      return true;
    });
  } while (t != first);
  if (!(lowest <= highest) || !std::isfinite(lowest) || !std::isfinite(highest)) return;
  const auto moved = static_cast<T>(static_cast<double>(own.z) + (lowest + highest) / 2);
  const double by = static_cast<double>(moved) - static_cast<double>(own.z);
  if (lowest <= by && by <= highest) own.z = moved;
}

template void GridSurface<float>::fit();
template void GridSurface<double>::fit();

}  // namespace terrace::tri::tin
