// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

#include <terrace/base/stop_check.hpp>

#include "facility/points/search_engine.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {

/// Returns the local search for a problem that check() has passed. strategy: one of local search,
/// or automatic.
/// Throws: std::invalid_argument if the problem does not admit the strategy.
[[nodiscard]] std::unique_ptr<SearchEngine> make_search(
    const FacilityPoints& problem, FacilityStrategy strategy = FacilityStrategy::automatic,
    unsigned threads = 1, const base::StopCheck& check_stop = {});
[[nodiscard]] std::unique_ptr<SearchEngine> make_search(
    const FacilityEntities& problem, FacilityStrategy strategy = FacilityStrategy::automatic,
    unsigned threads = 1, const base::StopCheck& check_stop = {});

/// Returns the number of candidates of a search over this many points; at least 1 unless there are
/// no points.
[[nodiscard]] std::size_t candidate_count(Effort effort, std::size_t points);

/// Runs the complete search that the options request.
[[nodiscard]] FacilitySolution run_search(SearchEngine& engine, const FacilityOptions& options,
                                          FacilityReport* report);

}  // namespace terrace::cluster
