// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "terrace/stream/point.hpp"

namespace terrace::terrain {

/// From each point the distance to the one that is `rank`-th nearest to it (1: the nearest), itself
/// not counted; to the farthest if there are no more, 0 for a single point. Coordinates must be
/// finite, rank from 1 to 32. Exact, by a k-d tree: O(n log n) time, 24 bytes per point.
std::vector<float> neighbour_distances(std::span<const stream::Point3> points, unsigned rank,
                                       unsigned threads);

}  // namespace terrace::terrain
