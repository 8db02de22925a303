// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "search_engine.hpp"
#include "terrace/cluster/facility.hpp"
#include "terrace/cluster/point_search.hpp"

namespace terrace::cluster {

/// The search for a problem that check() has passed. strategy: not fast.
/// Throws: std::invalid_argument if the metric does not admit the strategy.
[[nodiscard]] std::unique_ptr<SearchEngine> make_search(const FacilityPoints& problem,
                                                        GainStrategy strategy, unsigned threads);

/// Throws: std::invalid_argument if the strategy asks for more than the distances have; what: as in
/// messages.
void check_strategy(GainStrategy strategy, bool has_boxes, bool has_triangles,
                    const std::string& what);

/// The whole search that the options ask for.
[[nodiscard]] FacilitySolution run_search(SearchEngine& engine, const PointSearchOptions& options,
                                          PointSearchStatistics* statistics);

}  // namespace terrace::cluster
