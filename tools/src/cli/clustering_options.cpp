// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/clustering_options.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/units.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {
namespace {

using cluster::FacilityStrategy;

constexpr std::array<std::pair<const char*, FacilityStrategy>, 7> kStrategies{
    {{"automatic", FacilityStrategy::automatic},
     {"fast", FacilityStrategy::fast},
     {"full-scan", FacilityStrategy::full_scan},
     {"quadtree", FacilityStrategy::quadtree},
     {"octree", FacilityStrategy::octree},
     {"kd-tree", FacilityStrategy::kd_tree},
     {"facilities", FacilityStrategy::facilities}}};

}  // namespace

std::vector<std::string> names_of_strategies() {
  std::vector<std::string> names;
  for (const auto& [name, strategy] : kStrategies) names.emplace_back(name);
  return names;
}

FacilityStrategy strategy_of(const std::string& name) {
  return std::find_if(kStrategies.begin(), kStrategies.end(),
                      [&](const auto& row) { return name == row.first; })
      ->second;
}

std::pair<std::string, double> channel_of(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) {
    throw terrain::UsageError("--channel " + text + ": write NAME:WEIGHT, as in intensity:0.5");
  }
  const double weight =
      terrain::parse_number(text.substr(colon + 1), "the weight of --channel " + text);
  if (!(weight >= 0.0) || !std::isfinite(weight)) {
    throw terrain::UsageError("--channel " + text + ": a weight is a number from 0 up");
  }
  return {text.substr(0, colon), weight};
}

}  // namespace terrace::tools
