// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace terrace::tri::spatial {

/// Beyond each hull facet lies a ghost tetrahedron that joins it to this vertex "at infinity"; so
/// every facet has two tetrahedra.
inline constexpr std::uint32_t kGhost = 0;
inline constexpr std::uint32_t kFreeCorner = 0xFFFFFFFFu;

/// A side of a tetrahedron: tetrahedron * 4 + index of the corner opposite to it.
using Side = std::uint32_t;

constexpr Side make_side(std::uint32_t tetrahedron, std::uint32_t index) {
  return tetrahedron * 4 + index;
}
constexpr std::uint32_t tetrahedron_of(Side side) { return side >> 2; }
constexpr std::uint32_t index_of(Side side) { return side & 3; }

struct Tetrahedron {
  /// In order: det(b - a, c - a, d - a) > 0; with a ghost it is so for any point beyond its facet.
  /// A free slot has kFreeCorner first, then the next free slot.
  std::array<std::uint32_t, 4> corner;
  /// mate[i]: the same facet as the side opposite to corner[i], seen from the neighbour.
  std::array<Side, 4> mate;
};
static_assert(sizeof(Tetrahedron) == 32);

/// Corners of the facet opposite to corner i, so that corner i and these three are in order.
inline constexpr std::array<std::array<std::uint8_t, 3>, 4> kFacet = {
    {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

constexpr std::array<std::uint32_t, 3> facet_of(const Tetrahedron& t, std::uint32_t i) {
  const auto& f = kFacet[i];
  return {t.corner[f[0]], t.corner[f[1]], t.corner[f[2]]};
}

/// Index of the ghost among the corners, or 4.
constexpr std::uint32_t ghost_index(const std::array<std::uint32_t, 4>& corner) {
  std::uint32_t i = 0;
  while (i < 4 && corner[i] != kGhost) ++i;
  return i;
}
constexpr bool has_ghost(const std::array<std::uint32_t, 4>& corner) {
  return corner[0] == kGhost || corner[1] == kGhost || corner[2] == kGhost || corner[3] == kGhost;
}
/// A finite tetrahedron in use.
constexpr bool is_finite(const std::array<std::uint32_t, 4>& corner) {
  return corner[0] != kFreeCorner && !has_ghost(corner);
}

}  // namespace terrace::tri::spatial
