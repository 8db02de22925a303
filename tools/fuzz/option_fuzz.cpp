// SPDX-License-Identifier: GPL-3.0-or-later
// Option values. The first line names the parser, the second is the value.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "base/units.hpp"
#include "cli/option_values.hpp"
#include "fuzz_target.hpp"
#include "picture/camera.hpp"
#include "scan/criterion.hpp"
#include "synth/synth_cloud.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/bounded_mesh.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/heights.hpp"
#include "terrace/terrain/profile.hpp"
#include "terrace/terrain/raster.hpp"
#include "terrace/terrain/region.hpp"
#include "tile/format/address.hpp"

namespace terrace::terrain::fuzz {

using namespace tools;

namespace {

/// Parses an option whose value is a number or several. Returns nullopt if `name` is not one.
std::optional<bool> parse_numeric(std::string_view name, const std::string& value) {
  constexpr std::uint64_t kMaxMemory = std::uint64_t{1} << 63;
  if (name == "memory") {
    require(parse_memory(value) <= kMaxMemory, "no more than 2^63 bytes");
  } else if (name == "count") {
    static_cast<void>(with_commas(parse_count(value)));
  } else if (name == "size") {
    const ImageSize size = parse_size(value);
    require(size.width > 0 && size.height > 0 && size.width <= INT32_MAX, "a picture has cells");
  } else if (name == "number") {
    const double number = parse_number(value, "a test");
    require(std::isfinite(number), "a number is finite");
    require(parse_number(number_text(number), "a test") == number, "a number is read back");
  } else if (name == "numbers") {
    const std::vector<double> numbers = parse_numbers(value, "a test");
    require(numbers.size() == 1 + static_cast<std::size_t>(std::ranges::count(value, ',')),
            "a number between any two commas");
    for (const double number : numbers) require(std::isfinite(number), "numbers are finite");
  } else {
    return std::nullopt;
  }
  return true;
}

/// Parses an option that selects a part of a store. Returns nullopt if `name` is not one.
std::optional<bool> parse_selection(std::string_view name, const std::string& value) {
  if (name == "level") {
    const auto level = parse_level(value);
    require(!level || *level <= 255, "a level");
  } else if (name == "focus") {
    // Reject values that may be the name of a file of this machine.
    if (value.find_first_not_of("0123456789+-.,eE :top") != std::string::npos) return false;
    const Focus focus = parse_focus(value);
    require(!focus.region.box().empty(), "the box of a focus is not empty");
    require(!focus.level || *focus.level <= 255, "a level");
  } else if (name == "line") {
    // Reject values that may be the name of a file of this machine.
    if (value.find_first_not_of("0123456789+-.,;eE ") != std::string::npos) return false;
    for (const Point2& p : parse_line(value).places) {
      require(std::isfinite(p[0]) && std::isfinite(p[1]), "a line has places");
    }
  } else if (name == "line-file") {
    const MemoryFile file(value);
    require(parse_line(file.name()).places.size() >= 2, "a line has two places");
  } else if (name == "tile") {
    const auto tile = parse_tile_path(value);
    if (!tile) return false;
    require(tile_path(*tile) == value, "a tile has one path");
  } else {
    return std::nullopt;
  }
  return true;
}

/// Parses an option that takes one of a few words. Returns whether any of them accepts the value.
bool parse_word(const std::string& value) {
  const auto accepts_value = [&](auto parser) {
    try {
      static_cast<void>(parser(value));
      return 1;
    } catch (const UsageError&) {
      return 0;
    }
  };
  return accepts_value(parse_fill) + accepts_value(parse_quality) +
             accepts_value(parse_duplicates) + accepts_value(parse_raster_value) +
             accepts_value(parse_height_reference) + accepts_value(parse_interpolation) >
         0;
}

bool parse(std::string_view name, const std::string& value) {
  if (const auto result = parse_numeric(name, value)) return *result;
  if (const auto result = parse_selection(name, value)) return *result;
  if (name == "names") return parse_word(value);
  if (name == "smooth") {
    const auto smoothing = parse_smoothing(value);
    require(!smoothing || (smoothing->iterations >= 1 && smoothing->iterations <= 10000), "steps");
  } else if (name == "surface-smooth") {
    const auto smoothing = parse_surface_smoothing(value);
    require(!smoothing || (smoothing->iterations >= 1 && smoothing->iterations <= 10000), "steps");
  } else if (name == "view") {
    static_cast<void>(parse_view(value));
  } else if (name == "criterion") {
    static_cast<void>(parse_criterion(value));
  } else if (name == "channel") {
    const auto [channel, weight] = parse_channel(value);
    require(!channel.empty() && weight >= 0 && std::isfinite(weight), "a channel and its weight");
  } else if (name == "shuffle") {
    constexpr std::uint64_t kPoints = 50, kMemory = 1 << 20;
    const DeliveryOrder order(value, kPoints, /*seed=*/1, kMemory);
    std::vector<bool> seen(kPoints);
    for (std::uint64_t i = 0; i < kPoints; ++i) {
      const std::uint64_t point = order(i);
      require(point < kPoints && !seen[point], "each point once");
      seen[point] = true;
    }
  } else {
    return false;
  }
  return true;
}

}  // namespace

bool accepts(const std::uint8_t* data, std::size_t size) {
  std::string_view text = text_of(data, size);
  const std::string_view name = take_line(text);
  try {
    return parse(name, std::string(text));
  } catch (const UsageError& error) {
    require(*error.what() != '\0', "an error says what is wrong");
  } catch (const stream::Error& error) {
    require(!error.parts().cause.empty(), "a cause");
  }
  return false;
}

}  // namespace terrace::terrain::fuzz
