// SPDX-License-Identifier: Apache-2.0
#include <limits>

#include "surface.hpp"
#include "tin/error_queue.hpp"

namespace terrace::tri::tin {

constexpr float kMixed = std::numeric_limits<float>::infinity();

template <class T>
template <class Queue>
void GridSurface<T>::refine(std::size_t most) {
  Queue queue(static_cast<float>(bound_));
  coarse_first_ = !Queue::kExact;
  if (coarse_first_) make_coarse();
  const auto look = [&](std::uint32_t t) {
    judge(triangles_[t]);
    if (triangles_[t].error > 0) queue.push(triangles_[t].error, t);
  };
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) look(t);
  std::size_t with_data = 0;
  for (const Corner& vertex : corners_) with_data += sees(vertex) ? 1 : 0;
  for (;;) {
    const std::uint32_t t = queue.pop(triangles_, tiles_.count(), [&](const Triangle& triangle) {
      return tiles_.of(static_cast<std::int32_t>(triangle.place & 0xFFFF),
                       static_cast<std::int32_t>(triangle.place >> 16));
    });
    if (t == kNone || with_data >= most) return;
    if (triangles_[t].error == kMixed) {
      // Its cure may lie outside it and have become a vertex since.
      judge(triangles_[t]);
      if (triangles_[t].error == 0) continue;
    }
    const auto x = static_cast<std::int32_t>(triangles_[t].place & 0xFFFF);
    const auto y = static_cast<std::int32_t>(triangles_[t].place >> 16);
    const std::uint32_t around = triangles_[t].error == kMixed ? locate(x, y, t) : t;
    insert(x, y, around);
    with_data += sees(corners_.back()) ? 1 : 0;
    for (const std::uint32_t created : cavity_.created()) look(created);
    if (around != t) look(t);
  }
}

template void GridSurface<float>::refine<ErrorBuckets>(std::size_t);
template void GridSurface<double>::refine<ErrorBuckets>(std::size_t);
template void GridSurface<float>::refine<ErrorHeap>(std::size_t);
template void GridSurface<double>::refine<ErrorHeap>(std::size_t);

}  // namespace terrace::tri::tin
