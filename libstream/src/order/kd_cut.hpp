// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "terrace/stream/point.hpp"

namespace terrace::stream {

/// A point and its index in the input.
struct NumberedPoint {
  Point3 place;
  std::uint64_t number;
};

/// A plane across one of the axes. Points below the value are on the first side.
struct KdPlane {
  std::size_t axis = 0;
  double value = 0;

  [[nodiscard]] bool beyond(const Point3& p) const { return p[axis] >= value; }
};

/// Cuts points into `pieces` of sizes that differ by at most one, always across the axis of
/// greatest extent, with units of the axes as long as `lengths`. Ties in a coordinate are broken by
/// the points' numbers: the same pieces on every machine. Returns where the pieces begin and, last,
/// the number of points.
std::vector<std::size_t> cut_in_pieces(std::span<NumberedPoint> points, std::size_t pieces,
                                       const std::array<double, 3>& lengths);

/// The planes of a complete k-d tree over points, which are reordered accordingly: the root first,
/// the children of node i at 2i + 1 and 2i + 2.
std::vector<KdPlane> kd_planes(std::span<NumberedPoint> points, unsigned depth,
                               const std::array<double, 3>& lengths);

/// The leaf, counted from the left, of a complete tree of planes in which a point lies.
[[nodiscard]] inline std::size_t kd_leaf(std::span<const KdPlane> planes, const Point3& p) {
  std::size_t node = 0;
  while (node < planes.size()) node = 2 * node + 1 + (planes[node].beyond(p) ? 1 : 0);
  return node - planes.size();
}

}  // namespace terrace::stream
