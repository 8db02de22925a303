// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/detail_options.hpp"

#include <charconv>
#include <system_error>
#include <utility>

#include "terrace/terrain/error.hpp"

namespace terrace::tools {
namespace {

unsigned checked(std::optional<unsigned> level, const stream::Store& store) {
  const unsigned top = store.top();
  if (level && *level > top) {
    throw UsageError("the store has no level " + std::to_string(*level) + ": its top is level " +
                     std::to_string(top));
  }
  return level.value_or(top);
}

}  // namespace

Detail parse_detail(const stream::Store& store, const std::string& level, const std::string& region,
                    const std::vector<std::string>& focuses, const RegionConversion& conversion) {
  Detail detail;
  if (!level.empty()) {
    detail.level = checked(parse_level(level), store);
  } else if (!focuses.empty()) {
    detail.level = store.top();
  }
  if (!region.empty()) detail.region = conversion(Region::parse(region));
  for (const std::string& text : focuses) {
    Focus focus = parse_focus(text);
    detail.focuses.push_back({conversion(std::move(focus.region)), checked(focus.level, store)});
  }
  return detail;
}

std::optional<unsigned> parse_level(const std::string& text) {
  if (text == "top") return std::nullopt;
  unsigned level = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), level);
  if (error != std::errc{} || end != text.data() + text.size() || level > 255) {
    throw UsageError("'" + text + "' is not a level; write a number from 0 (full detail) or 'top'");
  }
  return level;
}

Focus parse_focus(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) {
    throw UsageError("the focus '" + text + "' names no level; write BOX:L");
  }
  return {.region = Region::parse(text.substr(0, colon)),
          .level = parse_level(text.substr(colon + 1))};
}

}  // namespace terrace::tools
