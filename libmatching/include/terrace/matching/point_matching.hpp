// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/matching/matching.hpp"
#include "terrace/matching/point.hpp"

namespace terrace::matching {

/// A distance supplied by the caller. It must be symmetric and at least `factor * (Euclidean
/// distance) - offset`, in the unit of the points. This bound prunes the search for pairs. With
/// factor 0 nothing is pruned, and pricing takes O(n^2) calls.
struct PointMetric {
  /// Distance of two points given by index.
  std::function<double(std::uint32_t, std::uint32_t)> distance;
  double factor = 1.0;  ///< at least 0
  double offset = 0.0;  ///< at least 0
};

struct PointMatchingOptions {
  /// Each point gets candidate edges to this many nearest points, at least 1.
  std::uint32_t neighbours = 8;
  /// Additional candidate edges, for instance from a Delaunay triangulation.
  std::span<const std::pair<std::uint32_t, std::uint32_t>> candidates{};
  PointMetric metric{};  ///< Euclidean where `distance` is empty
  base::StopCheck check_stop = {};
};

/// The optimal matching of points and its proof.
struct PointMatching {
  std::vector<std::uint32_t> mate;  ///< partner of each point, kNone for the one left over
  double cost = 0.0;                ///< sum of the distances of all pairs
  double dual_bound = 0.0;          ///< lower bound of every matching's cost, see below
  std::uint32_t left_over = kNone;  ///< the point without a partner where n is odd
  std::size_t rounds = 0;           ///< rounds of solving and pricing
  std::size_t edges = 0;            ///< candidate edges in the last round
  Matching proof;  ///< proof for the sparse graph. If n is odd, vertex n is a dummy partner.
};

/// Minimum-weight perfect matching of points on the complete graph.
///
/// points: any number, finite. Duplicates are allowed. If their number is odd, the one left over is
/// the point whose removal makes the rest cheapest.
///
/// Method: the blossom algorithm on candidate edges, then pricing. Pricing finds absent pairs that
/// are closer than their duals allow, blossom by blossom, with a tree of boxes that holds the
/// largest dual of each box. These pairs are added and the matching is repaired until no such pair
/// is left. So the result is optimal on the complete graph, for distances rounded to multiples of
/// 2^-48 of the longest candidate edge (fewer bits only where the duals would not fit).
///
/// Returns: the same matching for the same input, options and metric.
///
/// Throws: std::invalid_argument for a coordinate or distance that is not finite (the message gives
/// its index), a candidate edge with an end out of range, and n above 2^29.
///
/// Cost: about n^1.2 on uniform points in the plane, n^1.3 in space (measured, 10,000 to 1,000,000
/// points), and more where many odd clusters are far apart. About 0.8 kB per point.
///
/// Source: pricing as in W. Cook and A. Rohe, "Computing minimum-weight perfect matchings", 1999.
PointMatching match_points(std::span<const Point2> points,
                           const PointMatchingOptions& options = {});
PointMatching match_points(std::span<const Point3> points,
                           const PointMatchingOptions& options = {});

}  // namespace terrace::matching
