// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>

#include "terrace/cluster/facility.hpp"
#include "terrace/cluster/point.hpp"
#include "terrace/cluster/point_search.hpp"

/// Facility location of anything that distances can be given for: triangles, segments, words. Each
/// cluster has a representative among the entities. Source: J. Skála, Algorithms for manipulating
/// large geometric data, 4.2.3 and chapter 9.

namespace terrace::cluster {

/// Entities by number; every one is a client and a place for a facility.
struct EntityProblem {
  std::size_t count = 0;
  /// From a facility to a client: finite, not negative, 0 from an entity to itself. Called by
  /// several threads at once if the search has several.
  std::function<double(std::uint32_t facility, std::uint32_t client)> distance = {};
  bool symmetric = false;            ///< distance(a, b) == distance(b, a) always
  bool triangle_inequality = false;  ///< distance(a, c) <= distance(a, b) + distance(b, c) always
  std::span<const double> weights = {};  ///< positive and finite, or empty for 1 each
  double facility_cost = 1.0;            ///< positive, in the unit of the distances
  /// What leaving an entity of weight 1 out costs, in that unit; infinite: none is left out.
  double outlier_price = std::numeric_limits<double>::infinity();
};

/// Throws: std::invalid_argument on no entities, more than 2^32 - 2, a missing function, weights or
/// costs out of range, naming the index.
void check(const EntityProblem& problem);

/// As search_points(). Strategies: full_scan; facilities if the distances declare symmetry and
/// triangle inequality; automatic takes that where it can.
/// Throws: std::invalid_argument as check(), and as search_points().
/// Cost: iterations times O(count) calls of the function at most, and O(count k) for the start.
[[nodiscard]] FacilitySolution search_entities(const EntityProblem& problem,
                                               const PointSearchOptions& options = {},
                                               PointSearchStatistics* statistics = nullptr);

using Segment = std::array<Point3, 2>;
using Triangle = std::array<Point3, 3>;

/// How far the corners of one must move to lie on those of the other, root mean square, under the
/// best of the correspondences (two of a segment, six of a triangle). So neither direction nor
/// first corner matters, and moving an entity by v is a distance of |v|.
///
/// These are metrics on unordered corners: for a renumbering g, |a - g b| is the Euclidean distance
/// of all coordinates, which renumbering both does not change; so with the best g and h
/// d(a, c) <= |a - g h c| <= |a - g b| + |g b - g h c| = d(a, b) + d(b, c). Symmetric likewise, and
/// 0 only for equal sets of corners. Coordinates must be finite; a result beyond double's range is
/// infinite.
[[nodiscard]] double segment_distance(const Segment& a, const Segment& b);
[[nodiscard]] double triangle_distance(const Triangle& a, const Triangle& b);

}  // namespace terrace::cluster
