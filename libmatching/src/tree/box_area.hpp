// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <tuple>

namespace terrace::matching::tree {

/// Returns the surface area of a box, or its perimeter in the plane.
template <class AnyBox>
double area_of(const AnyBox& box) {
  std::array<double, std::tuple_size_v<decltype(box.lo)>> side;
  for (std::size_t d = 0; d < side.size(); ++d) {
    side[d] = static_cast<double>(box.hi[d]) - static_cast<double>(box.lo[d]);
  }
  if constexpr (side.size() == 2) {
    return 2.0 * (side[0] + side[1]);
  } else {
    return 2.0 * (side[0] * side[1] + side[1] * side[2] + side[2] * side[0]);
  }
}

}  // namespace terrace::matching::tree
