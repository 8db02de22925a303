// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/region.hpp"

/// --level, --region and --focus.

namespace terrace::tools {

using namespace terrain;

/// "top" (nothing) or a number from 0 to 255. Throws: UsageError.
std::optional<unsigned> parse_level(const std::string& text);

/// A region and the level wanted there: "BOX:L" with L a number or "top" (nothing).
struct Focus {
  Region region;
  std::optional<unsigned> level;
};
/// Throws: as Region::parse; UsageError without a level.
Focus parse_focus(const std::string& text);

/// The levels as asked for, checked against the store. An empty level is the top if there are
/// focuses, else level 0. conversion: of regions that are given in another CRS.
/// Throws: as Region::parse; UsageError for a level above the store's top.
Detail parse_detail(const stream::Store& store, const std::string& level, const std::string& region,
                    const std::vector<std::string>& focuses,
                    const RegionConversion& conversion = {});

}  // namespace terrace::tools
