// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

#include "tables/cluster_run.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

/// What `terrace cluster` tells of its result: clusters, costs, and how far from the optimum.
Summary cluster_summary(const ClusterOutcome& outcome, std::uint64_t points, std::size_t outliers,
                        double seconds);

}  // namespace terrace::tools
