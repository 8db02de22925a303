// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/option_names.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace terrace::tools {
namespace {

/// Pairs of a parameter and its option. tests/layout checks that every parameter that the libraries
/// name in messages is listed.
constexpr auto kOptions = std::to_array<std::pair<std::string_view, std::string_view>>({
    {"align", "--align"},
    {"append", "--append"},
    {"band", "--band"},
    {"batch", "--batch"},
    {"block_points", "--block"},
    {"cell", "--cell"},
    {"channel", "--channel"},
    {"cluster", "--cluster"},
    {"crs", "--crs"},
    {"drop", "--drop"},
    {"duplicates", "--duplicates"},
    {"entities", "--entities"},
    {"facility_cost", "--facility-cost"},
    {"fill", "--fill"},
    {"focus", "--focus"},
    {"format", "--input-format"},
    {"geoid", "--geoid"},
    {"heights_of_colour", "--rgb"},
    {"interval", "--interval"},
    {"k", "-k"},
    {"keep", "--keep"},
    {"level", "--level"},
    {"max_edge", "--max-edge"},
    {"max_error", "--max-error"},
    {"max_points", "--max-points"},
    {"memory_bytes", "--memory"},
    {"metadata", "--metadata"},
    {"method", "--method"},
    {"metric", "--metric"},
    {"near", "--near"},
    {"outlier_price", "--outlier-price"},
    {"output_format", "--format"},
    {"own_crs", "--own-crs"},
    {"radius", "--within"},
    {"region", "--region"},
    {"region_crs", "--region-crs"},
    {"replace", "--force"},
    {"resolution", "--resolution"},
    {"resume", "--resume"},
    {"search_threads", "--search-threads"},
    {"shift", "--towgs84"},
    {"step", "--step"},
    {"strategy", "--strategy"},
    {"surface_from", "--surface-from"},
    {"threads", "--threads"},
    {"to_crs", "--to-crs"},
    {"vertical", "--vertical"},
    {"water", "--water"},
    {"where", "--where"},
    {"zoom", "--zoom"},
});

}  // namespace

std::string option_text(const stream::Message& message) {
  return message.text([](std::string_view name) {
    const auto* const option = std::find_if(kOptions.begin(), kOptions.end(),
                                            [&](const auto& row) { return row.first == name; });
    return std::string(option == kOptions.end() ? name : option->second);
  });
}

}  // namespace terrace::tools
