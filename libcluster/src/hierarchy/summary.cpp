// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "ground.hpp"
#include "hierarchy/block.hpp"

// A distance is computed as |map * (a - b)|. With u = 2^-53 the difference is off by at most u,
// each row of the product by 4 u, and the length by 3 u more, all relative to the sum of the
// absolute terms, which ground_extent() of a box around both points bounds. So adding 16 u times
// that extent makes the result an upper bound. It adds nothing if all points are equal.

namespace terrace::cluster {
namespace {

constexpr double kRounding = 0x1p-49;

// Below this, the square of a distance may have lost some or all of its digits.
constexpr double kSmallestSquare = 1e-280;
constexpr double kSmallestLength = 1e-139;  // more than the square root of kSmallestSquare

// Returns an upper bound of the length whose square is `squared`, between two points of `box`.
double length_bound(double squared, const GroundMap& map, const Box3& box) {
  const double extent = ground_extent(map, box);
  const double length = squared < kSmallestSquare ? kSmallestLength : std::sqrt(squared);
  return std::min(extent, length + kRounding * extent);
}

// Returns the distance from `from` to the farthest corner of the box. No point of the box is
// farther.
double farthest_corner(const Point3& from, const GroundMap& map, const Box3& box) {
  const Point3 low = difference(box.min, from);
  const Point3 high = difference(box.max, from);
  double squared = 0.0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const Point3 v{corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1],
                   corner & 4 ? high[2] : low[2]};
    squared = std::max(squared, squared_length(mapped(map, v)));
  }
  return length_bound(squared, map, box);
}

// ground: returns the ground length of a difference vector.
template <class Ground>
ClusterSummary summarise(std::span<const Point3> positions, std::span<const std::uint32_t> members,
                         std::uint32_t representative, const GroundMap& map, Ground ground) {
  const Point3 from = positions[representative];
  Box3 box{from, from};
  double squared = 0.0;
  for (const std::uint32_t member : members) {
    const Point3& p = positions[member];
    box.include(p);
    const double d = squared_length(ground(difference(p, from)));
    squared = d > squared ? d : squared;
  }
  return {box, length_bound(squared, map, box), members.size()};
}

}  // namespace

ClusterSummary summarise_points(std::span<const Point3> positions,
                                std::span<const std::uint32_t> members,
                                std::uint32_t representative, const GroundMap& map) {
  if (is_diagonal(map)) {
    const Point3 diagonal{map[0], map[4], map[8]};
    return summarise(positions, members, representative, map, [diagonal](const Point3& v) {
      return Point3{diagonal[0] * v[0], diagonal[1] * v[1], diagonal[2] * v[2]};
    });
  }
  return summarise(positions, members, representative, map,
                   [map](const Point3& v) { return mapped(map, v); });
}

ClusterSummary summarise_heads(std::span<const Point3> positions,
                               std::span<const ClusterSummary> heads,
                               std::span<const std::uint32_t> members, std::uint32_t representative,
                               const GroundMap& map) {
  const Point3& from = positions[representative];
  ClusterSummary result{Box3{}, 0.0, 0};
  double by_triangle = 0.0;
  for (const std::uint32_t member : members) {
    const Point3& p = positions[member];
    const double leg =
        length_bound(squared_length(mapped(map, difference(p, from))), map,
                     {{std::min(p[0], from[0]), std::min(p[1], from[1]), std::min(p[2], from[2])},
                      {std::max(p[0], from[0]), std::max(p[1], from[1]), std::max(p[2], from[2])}});
    by_triangle = std::max(by_triangle, (leg + heads[member].error) * (1.0 + 0x1p-52));
    result.box.include(heads[member].box);
    result.descendants += heads[member].descendants;
  }
  result.error = std::min(by_triangle, farthest_corner(from, map, result.box));
  return result;
}

}  // namespace terrace::cluster
