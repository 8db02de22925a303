// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/cluster_summary.hpp"

#include <algorithm>
#include <optional>
#include <string>

#include "base/units.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

std::string rounded(double value) { return readable_number(value, 6); }

}  // namespace

Summary cluster_summary(const ClusterOutcome& outcome, std::uint64_t points, std::size_t outliers,
                        double seconds) {
  const auto number = [](const std::optional<double>& value) -> nlohmann::ordered_json {
    return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
  };
  std::optional<double> cost;
  if (outcome.connection_cost) {
    cost = *outcome.connection_cost + outcome.opening_cost.value_or(0.0) +
           outcome.outlier_cost.value_or(0.0);
  }
  std::optional<double> gap;
  if (cost && outcome.lower_bound && *outcome.lower_bound > 0) {
    gap = std::max(0.0, *cost / *outcome.lower_bound - 1.0);
  }
  Summary summary;
  summary.json = {{"points", points},
                  {"clusters", outcome.representatives.size()},
                  {"outliers", outliers},
                  {"cost", number(cost)},
                  {"opening_cost", number(outcome.opening_cost)},
                  {"connection_cost", number(outcome.connection_cost)},
                  {"outlier_cost", number(outcome.outlier_cost)},
                  {"lower_bound", number(outcome.lower_bound)},
                  {"gap", number(gap)},
                  {"seconds", seconds},
                  {"peak_rss_bytes", peak_rss_bytes()}};
  std::string& text = summary.text;
  text = with_commas(points) + " points, ";
  if (!outcome.labels.empty()) {
    text += with_commas(outcome.representatives.size()) + " clusters";
    if (outliers > 0) text += " and " + with_commas(outliers) + " outliers";
    text += ", ";
  }
  text += readable_seconds(seconds) + "\n";
  if (cost) {
    text += "cost " + rounded(*cost);
    if (outcome.opening_cost) {
      text += " = " + rounded(*outcome.opening_cost) + " for opening + " +
              rounded(*outcome.connection_cost) + " for connecting";
    }
    if (outliers > 0) text += " + " + rounded(*outcome.outlier_cost) + " for outliers";
    text += "\n";
  }
  if (gap) {
    text += "lower bound " + rounded(*outcome.lower_bound) + ": at most " +
            readable_bound(100 * *gap) + " % above the optimum\n";
  }
  return summary;
}

}  // namespace terrace::tools
