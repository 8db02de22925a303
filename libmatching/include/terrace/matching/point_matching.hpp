// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "terrace/matching/matching.hpp"
#include "terrace/matching/point.hpp"

namespace terrace::matching {

/// A distance of the caller's. It must be symmetric and not below
/// `factor * (Euclidean distance) - offset`, in the unit of the points: by that bound pairs are
/// left out of the search. With factor 0 nothing is left out, and pricing takes O(n^2) calls.
struct PointMetric {
  std::function<double(std::uint32_t, std::uint32_t)> distance;  ///< of two points, by index
  double factor = 1.0;                                           ///< not negative
  double offset = 0.0;                                           ///< not negative
};

struct PointMatchingOptions {
  std::uint32_t neighbours = 8;  ///< candidate edges: so many nearest points of each, at least 1
  /// Candidate edges as well, for instance of a Delaunay triangulation.
  std::span<const std::pair<std::uint32_t, std::uint32_t>> candidates{};
  PointMetric metric{};  ///< Euclidean where `distance` is empty
};

/// The optimal matching of points and its proof.
struct PointMatching {
  std::vector<std::uint32_t> mate;    ///< partner of each point, kNobody for the one left over
  double cost = 0.0;                  ///< sum of the distances of all pairs
  double dual_bound = 0.0;            ///< no matching costs less, but for the rounding named below
  std::uint32_t left_over = kNobody;  ///< the point without partner where n is odd
  std::size_t rounds = 0;             ///< of solving and pricing
  std::size_t edges = 0;              ///< in the last round
  Matching proof;                     ///< of the sparse graph; for odd n vertex n stands for nobody
};

/// Minimum-weight perfect matching of points on the complete graph.
///
/// points: any number, finite; equal ones allowed. Of an odd number that one is left over without
/// which the rest costs least.
///
/// Method: the blossom algorithm on candidate edges, then pricing: absent pairs that are nearer
/// than their duals allow are found through a tree of boxes with the largest dual in each, blossom
/// by blossom, added, and the matching repaired, until none is left. So the result is optimal on
/// the complete graph, for distances rounded to multiples of 2^-48 (fewer bits only where the duals
/// would not fit) of the longest candidate edge.
///
/// Returns: the same for the same input, options and metric.
///
/// Throws: std::invalid_argument for a coordinate or distance that is not finite (its index is
/// named), a candidate edge with an end out of range, and n above 2^29.
///
/// Cost: on uniform points about n^1.2 in the plane, n^1.3 in space (measured, 10,000 to 1,000,000
/// points); more where many odd clusters are far apart. About 0.8 kB per point.
///
/// Source: pricing as in W. Cook and A. Rohe, "Computing minimum-weight perfect matchings", 1999.
PointMatching match_points(std::span<const Point2> points,
                           const PointMatchingOptions& options = {});
PointMatching match_points(std::span<const Point3> points,
                           const PointMatchingOptions& options = {});

}  // namespace terrace::matching
