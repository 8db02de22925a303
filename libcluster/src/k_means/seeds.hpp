// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <random>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "k_means/tree.hpp"

namespace terrace::cluster {

/// Returns positions of k seeds by greedy k-means++. Each seed is drawn several times, with
/// probability proportional to weight times squared distance to the nearest seed so far, and the
/// draw that leaves the least sum of these costs is taken. Boxes that a new seed cannot improve are
/// skipped.
[[nodiscard]] std::vector<Point3> k_means_seeds(const KMeansTree& tree, std::size_t clusters,
                                                std::mt19937_64& random,
                                                const base::StopCheck& check_stop);

}  // namespace terrace::cluster
