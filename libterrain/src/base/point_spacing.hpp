// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "terrace/stream/point.hpp"

namespace terrace::terrain {

/// Returns the distance from each point to its `rank`-th nearest other point (1: the nearest), or
/// to the farthest if there are fewer; 0 for a single point. Coordinates must be finite, rank from
/// 1 to 32. Exact, by a k-d tree: O(n log n) time, 24 bytes per point.
/// Throws: stream::Stopped after a stop.
std::vector<float> neighbour_distances(std::span<const stream::Point3> points, unsigned rank,
                                       unsigned threads, const std::stop_token& stop = {});

}  // namespace terrace::terrain
