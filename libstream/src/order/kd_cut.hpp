// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "terrace/stream/point.hpp"

namespace terrace::stream {

/// A place and its index in the input. Integers take half the room of doubles.
template <class Coordinate>
struct Numbered {
  std::array<Coordinate, 3> place;
  std::conditional_t<sizeof(Coordinate) == 4, std::uint32_t, std::uint64_t> number;
};
using NumberedPoint = Numbered<double>;
using NumberedIntegers = Numbered<std::int32_t>;

/// A plane across one of the axes. Points below the value are on the first side.
struct KdPlane {
  std::size_t axis = 0;
  double value = 0;

  [[nodiscard]] bool beyond(const Point3& p) const { return p[axis] >= value; }
};

/// Cuts points into `pieces` of sizes that differ by at most one, always across the axis of
/// greatest extent, with units of the axes as long as `lengths`. Ties in a coordinate are broken by
/// the points' numbers: the same pieces on every machine. Returns where the pieces begin and, last,
/// the number of points. Coordinates are doubles or 32-bit integers: they make no difference.
template <class Coordinate>
std::vector<std::size_t> cut_in_pieces(std::span<Numbered<Coordinate>> points, std::size_t pieces,
                                       const std::array<double, 3>& lengths);

/// The planes of a complete k-d tree over points, which are reordered accordingly: the root first,
/// the children of node i at 2i + 1 and 2i + 2.
std::vector<KdPlane> kd_planes(std::span<NumberedPoint> points, unsigned depth,
                               const std::array<double, 3>& lengths);

/// The leaves, counted from the left, of a complete tree of planes in which places lie: `place_of`
/// gives those from 0 on, and `take` is given the number of each and its leaf.
template <class PlaceOf, class Take>
void kd_leaves(std::span<const KdPlane> planes, std::size_t count, const PlaceOf& place_of,
               const Take& take) {
  // Several places go down the tree side by side: each step waits for the one before.
  constexpr std::size_t kSideBySide = 8;
  const auto walk = [&](std::size_t first, auto places) {
    std::array<std::size_t, places> nodes{};
    for (std::size_t levels = planes.size(); levels > 0; levels /= 2) {
      for (std::size_t i = 0; i < places; ++i) {
        const KdPlane& plane = planes[nodes[i]];
        nodes[i] = 2 * nodes[i] + 1 + (plane.beyond(place_of(first + i)) ? 1 : 0);
      }
    }
    for (std::size_t i = 0; i < places; ++i) take(first + i, nodes[i] - planes.size());
  };
  std::size_t i = 0;
  for (; i + kSideBySide <= count; i += kSideBySide) {
    walk(i, std::integral_constant<std::size_t, kSideBySide>{});
  }
  for (; i < count; ++i) walk(i, std::integral_constant<std::size_t, 1>{});
}

}  // namespace terrace::stream
