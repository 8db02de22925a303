// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace terrace::tri::planar {

/// Beyond each hull edge lies a ghost triangle that joins it to this vertex "at infinity"; so every
/// edge has two triangles and the whole is a sphere: n vertices have 2 n - 2 triangles, ghosts
/// included.
inline constexpr std::uint32_t kGhost = 0;
inline constexpr std::uint32_t kFreeCorner = 0xFFFFFFFFu;

/// A side of a triangle: triangle * 4 + index of the corner opposite to it.
using Side = std::uint32_t;

constexpr Side make_side(std::uint32_t triangle, std::uint32_t index) {
  return triangle * 4 + index;
}
constexpr std::uint32_t triangle_of(Side side) { return side >> 2; }
constexpr std::uint32_t index_of(Side side) { return side & 3; }

/// Index after and before i, counter-clockwise, of 0, 1, 2: from a table in a constant.
constexpr std::uint32_t next_index(std::uint32_t i) { return 0b001001u >> (2 * i) & 3; }
constexpr std::uint32_t previous_index(std::uint32_t i) { return 0b010010u >> (2 * i) & 3; }

struct Triangle {
  /// Counter-clockwise. A free slot has kFreeCorner first.
  std::array<std::uint32_t, 3> corner;
  /// mate[i]: the same edge as the side opposite to corner[i], seen from the neighbour. So the
  /// neighbour's corner beyond it is known without a search.
  std::array<Side, 3> mate;
};
static_assert(sizeof(Triangle) == 24);

constexpr bool has_ghost(const std::array<std::uint32_t, 3>& corner) {
  // One branch for the three: the least is zero.
  return std::min(corner[0], std::min(corner[1], corner[2])) == kGhost;
}
/// A finite triangle in use.
constexpr bool is_finite(const std::array<std::uint32_t, 3>& corner) {
  return corner[0] != kFreeCorner && !has_ghost(corner);
}

}  // namespace terrace::tri::planar
