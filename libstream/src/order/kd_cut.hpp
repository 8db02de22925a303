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

/// A place and its index in the input. Integers take half the memory of doubles.
template <class Coordinate>
struct Numbered {
  std::array<Coordinate, 3> place;
  std::conditional_t<sizeof(Coordinate) == 4, std::uint32_t, std::uint64_t> number;
};
using NumberedPoint = Numbered<double>;
using NumberedIntegers = Numbered<std::int32_t>;

/// A plane perpendicular to one of the axes. Points below `value` are on the first side.
struct KdPlane {
  std::size_t axis = 0;
  double value = 0;

  [[nodiscard]] bool is_above(const Point3& p) const { return p[axis] >= value; }
};

/// Cuts points into `pieces` of sizes that differ by at most one, always across the axis of
/// greatest extent. lengths: of the axes' units. Ties in a coordinate are broken by the points'
/// numbers, so pieces are the same on every machine. Returns the beginnings of the pieces followed
/// by the number of points. Double and 32-bit integer coordinates give the same pieces.
template <class Coordinate>
std::vector<std::size_t> cut_in_pieces(std::span<Numbered<Coordinate>> points, std::size_t pieces,
                                       const std::array<double, 3>& lengths);

/// Returns the planes of a complete k-d tree over points: the root first, the children of node i at
/// 2i + 1 and 2i + 2. Reorders the points by the tree.
std::vector<KdPlane> kd_planes(std::span<NumberedPoint> points, unsigned depth,
                               const std::array<double, 3>& lengths);

/// Finds the leaves of a complete tree of planes that contain places. Calls take(i, leaf) for each
/// i below `count` with the leaf of place_of(i), counted from the left.
template <class PlaceOf, class Take>
void kd_leaves(std::span<const KdPlane> planes, std::size_t count, const PlaceOf& place_of,
               const Take& take) {
  // Several points go down the tree in parallel, because each step of one point waits for the step
  // before it.
  constexpr std::size_t kBatch = 8;
  const auto walk = [&](std::size_t first, auto lanes) {
    std::array<std::size_t, lanes> nodes{};
    for (std::size_t levels = planes.size(); levels > 0; levels /= 2) {
      for (std::size_t i = 0; i < lanes; ++i) {
        const KdPlane& plane = planes[nodes[i]];
        nodes[i] = 2 * nodes[i] + 1 + (plane.is_above(place_of(first + i)) ? 1 : 0);
      }
    }
    for (std::size_t i = 0; i < lanes; ++i) take(first + i, nodes[i] - planes.size());
  };
  std::size_t i = 0;
  for (; i + kBatch <= count; i += kBatch) {
    walk(i, std::integral_constant<std::size_t, kBatch>{});
  }
  for (; i < count; ++i) walk(i, std::integral_constant<std::size_t, 1>{});
}

}  // namespace terrace::stream
