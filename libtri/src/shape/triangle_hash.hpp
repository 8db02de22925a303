// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <type_traits>

#include <terrace/base/portable_math.hpp>
#include <terrace/base/random.hpp>

namespace terrace::tri::shape {

template <class Coord>
std::uint64_t bit_pattern(Coord c) {
  if constexpr (std::is_integral_v<Coord>) {
    return static_cast<std::uint32_t>(c);
  } else {
    return base::bit_cast<std::uint64_t>(c + 0.0);  // merges -0.0 and 0.0
  }
}

/// A hash of an oriented triangle, whichever corner is first. The sum over a set of triangles does
/// not depend on their order.
template <class Coord>
std::uint64_t triangle_hash(std::array<std::array<Coord, 3>, 3> corners) {
  std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  std::uint64_t hash = 0;
  for (const auto& corner : corners)
    for (const Coord c : corner) hash = base::mix64(hash ^ bit_pattern(c)) + 1;
  return hash;
}

}  // namespace terrace::tri::shape
