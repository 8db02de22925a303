// SPDX-License-Identifier: Apache-2.0
#include <limits>

#include "surface.hpp"
#include "tin/star.hpp"

namespace terrace::tri::tin {

template <class T>
void GridSurface<T>::remove() {
  std::vector<std::uint32_t> triangle_of = triangle_of_vertices(triangles_, corners_.size());
  Star star;
  PolygonFill fill;
  Corner ring[kMaxRing];
  Corner removed{};
  const auto left = [&](std::size_t i, std::size_t m, std::size_t j) {
    return turn(ring[i], ring[m], ring[j]) > 0;
  };
  const auto inside = [&](std::size_t i, std::size_t m, std::size_t j, std::size_t p) {
    return ground_.in_circle(ring[i], ring[m], ring[j], ring[p]);
  };
  const auto within = [&](std::size_t i, std::size_t m, std::size_t j) {
    return fits(ring[i], ring[m], ring[j], removed);
  };
  AnyFill any(within, fill);
  for (std::uint32_t vertex = 0; vertex < corners_.size(); ++vertex) {
    const Corner& own = corners_[vertex];
    if (triangle_of[vertex] == kNone || own.x == 0 || own.y == 0 || own.x == columns_ - 1 ||
        own.y == rows_ - 1 || !star.gather(triangles_, vertex, triangle_of[vertex]))
      continue;
    const std::size_t size = star.size();
    removed = own;
    for (std::size_t i = 0; i < size; ++i) ring[i] = corners_[star.ring(i)];
    const bool possible = (fill_delaunay(size, left, inside, fill) && star.all_of(fill, within)) ||
                          (size > 3 && any.find(size));
    if (possible) star.replace(triangles_, fill, triangle_of, vertex);
  }
}

template void GridSurface<float>::remove();
template void GridSurface<double>::remove();

}  // namespace terrace::tri::tin
