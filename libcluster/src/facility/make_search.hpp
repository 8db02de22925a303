// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "facility/search_engine.hpp"
#include "facility/search_frame.hpp"
#include "facility/search_space.hpp"
#include "terrace/cluster/facility.hpp"
#include "terrace/cluster/point_search.hpp"

namespace terrace::cluster {

/// The search for a problem that check() has passed. strategy: not fast.
/// Throws: std::invalid_argument if the metric does not admit the strategy.
[[nodiscard]] std::unique_ptr<SearchEngine> make_search(const FacilityPoints& problem,
                                                        GainStrategy strategy, unsigned threads);

/// The same for distances by index. frame: weights and costs alone.
[[nodiscard]] std::unique_ptr<SearchEngine> make_search(SearchFrame& frame, IndexSpace space,
                                                        GainStrategy strategy, unsigned threads);

/// The whole search that the options ask for.
[[nodiscard]] FacilitySolution run_search(SearchEngine& engine, const PointSearchOptions& options,
                                          PointSearchStatistics* statistics);

}  // namespace terrace::cluster
