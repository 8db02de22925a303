// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "terrace/cluster/block.hpp"
#include "terrace/cluster/point.hpp"

/// How long a local search is, and the plain one that BlockClusterer is measured against.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 4.2.3 and 7.3.1.

namespace terrace::cluster {

/// Number of candidates that a local search over m points tries.
enum class SearchLength : std::uint8_t {
  tenth,       ///< 0.1 m, at least 1
  log10_full,  ///< m ceil(log10 m), what the thesis calls the full search
  log2_full,   ///< m ceil(log2 m)
};

/// The candidates of a search of that length, at least one for a block that is not empty.
[[nodiscard]] std::size_t candidate_count(SearchLength length, std::size_t points);

/// Meyerson's start and a search of the given length with Euclidean distances, each candidate
/// judged by a scan of all points in double precision: the algorithm as the literature states it,
/// slow. search_points() in point_search.hpp gives the same solution faster.
/// weights as in BlockClusterer::run. An empty block gives an empty result.
void local_search(std::span<const Point3> points, std::span<const double> weights,
                  double facility_cost, SearchLength length, std::uint64_t seed,
                  BlockClustering& clustering);

}  // namespace terrace::cluster
