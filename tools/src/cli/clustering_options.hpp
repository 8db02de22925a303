// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <terrace/cluster/facility_location.hpp>

/// Options of clustering that `build` and `cluster` share.

namespace terrace::tools {

/// What --strategy takes: the searches over points.
std::vector<std::string> names_of_strategies();
/// Requires: one of names_of_strategies().
cluster::FacilityStrategy strategy_of(const std::string& name);

/// NAME:WEIGHT of --channel; the name may hold colons.
/// Throws: UsageError on another form and a weight that is not a number from 0 up.
std::pair<std::string, double> channel_of(const std::string& text);

}  // namespace terrace::tools
