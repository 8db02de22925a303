// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/option_values.hpp"

#include <initializer_list>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "base/geojson_crs.hpp"
#include "base/json_of_file.hpp"
#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// Returns the level, or the top for nullopt. Throws UsageError if the store has no such level.
unsigned level_in_store(std::optional<unsigned> level, const stream::Store& store) {
  const unsigned top = store.top();
  if (level && *level > top) {
    throw UsageError(fmt::format("the store has no level {}: its top is level {}", *level, top));
  }
  return level.value_or(top);
}

/// Adds the coordinates of each LineString of a GeoJSON object to `lines`. `depth` is the nesting
/// of the object; deep nesting is ignored, because a crafted file could exhaust the stack.
void collect_line_strings(const nlohmann::json& object, int depth,
                          std::vector<std::vector<Point2>>& lines) {
  if (depth > 8) return;
  const std::string type = object.value("type", "");
  if (type == "Feature") {
    // A feature may have no geometry (RFC 7946, 3.2).
    const nlohmann::json& geometry = object.at("geometry");
    if (!geometry.is_null()) collect_line_strings(geometry, depth + 1, lines);
    return;
  }
  if (type == "FeatureCollection") {
    for (const nlohmann::json& feature : object.at("features"))
      collect_line_strings(feature, depth + 1, lines);
  } else if (type == "LineString") {
    lines.emplace_back();
    for (const nlohmann::json& p : object.at("coordinates")) {
      lines.back().push_back({p.at(0).get<double>(), p.at(1).get<double>()});
    }
  }
}

/// Parses the METHOD[:STEPS] of --smooth.
template <class Options, class Method>
std::optional<Options> parse_steps(
    const std::string& text, std::initializer_list<std::pair<std::string_view, Method>> methods) {
  if (text.empty()) return std::nullopt;
  const std::size_t colon = text.find(':');
  Options options;
  options.method = choice<Method>(text.substr(0, colon), "--smooth", methods);
  if (colon != std::string::npos) {
    const std::uint64_t steps = parse_count(text.substr(colon + 1));
    if (steps == 0 || steps > 10000) throw UsageError("--smooth takes 1 to 10000 steps");
    options.iterations = static_cast<unsigned>(steps);
  }
  return options;
}

}  // namespace

Fill parse_fill(const std::string& text) {
  return choice<Fill>(
      text, "--fill",
      {{"none", Fill::none}, {"flat", Fill::flat}, {"interpolate", Fill::interpolate}});
}

HeightReference parse_height_reference(const std::string& text) {
  if (text.empty()) return HeightReference::recorded;
  return choice<HeightReference>(text, "--vertical",
                                 {{"ellipsoidal", HeightReference::ellipsoidal},
                                  {"orthometric", HeightReference::orthometric},
                                  {"ignore", HeightReference::ignore}});
}

tri::TinQuality parse_quality(const std::string& text) {
  return choice<tri::TinQuality>(text, "--quality",
                                 {{"greedy", tri::TinQuality::greedy},
                                  {"removal", tri::TinQuality::removal},
                                  {"fitted", tri::TinQuality::fitted}});
}

tri::PointDuplicates parse_duplicates(const std::string& text) {
  return choice<tri::PointDuplicates>(text, "--duplicates",
                                      {{"all", tri::PointDuplicates::all},
                                       {"min", tri::PointDuplicates::min},
                                       {"max", tri::PointDuplicates::max},
                                       {"mean", tri::PointDuplicates::mean},
                                       {"first", tri::PointDuplicates::first},
                                       {"error", tri::PointDuplicates::error}});
}

tri::Interpolation parse_interpolation(const std::string& text) {
  return choice<tri::Interpolation>(text, "--method",
                                    {{"linear", tri::Interpolation::linear},
                                     {"natural", tri::Interpolation::natural_neighbour},
                                     {"nearest", tri::Interpolation::nearest}});
}

RasterValue parse_raster_value(const std::string& text) {
  return choice<RasterValue>(text, "--value",
                             {{"height", RasterValue::height},
                              {"slope", RasterValue::slope},
                              {"aspect", RasterValue::aspect},
                              {"hillshade", RasterValue::hillshade}});
}

cluster::FacilityStrategy parse_strategy(const std::string& text) {
  using cluster::FacilityStrategy;
  return choice<FacilityStrategy>(text, "--strategy",
                                  {{"automatic", FacilityStrategy::automatic},
                                   {"fast", FacilityStrategy::fast},
                                   {"full-scan", FacilityStrategy::full_scan},
                                   {"quadtree", FacilityStrategy::quadtree},
                                   {"octree", FacilityStrategy::octree},
                                   {"kd-tree", FacilityStrategy::kd_tree},
                                   {"facilities", FacilityStrategy::facilities}});
}

std::pair<std::string, double> parse_channel(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) {
    throw UsageError(fmt::format("--channel {}: write NAME:WEIGHT, as in intensity:0.5", text));
  }
  const double weight =
      parse_number(text.substr(colon + 1), fmt::format("the weight of --channel {}", text));
  if (weight < 0.0) {
    throw UsageError(fmt::format("--channel {}: the weight must not be negative", text));
  }
  return {text.substr(0, colon), weight};
}

Detail parse_detail(const stream::Store& store, const std::string& level, const std::string& region,
                    const std::vector<std::string>& focuses, const RegionConversion& conversion) {
  Detail detail;
  if (!level.empty()) {
    detail.level = level_in_store(parse_level(level), store);
  } else if (!focuses.empty()) {
    detail.level = store.top();
  }
  if (!region.empty()) detail.region = conversion(Region::parse(region, stop_token()));
  for (const std::string& text : focuses) {
    const std::string name = fmt::format("--focus {}", text);
    try {
      Focus focus = parse_focus(text);
      detail.focuses.push_back(
          {conversion(std::move(focus.region)), level_in_store(focus.level, store)});
    } catch (const UsageError& error) {
      throw UsageError(stream::message("{}: {}", name, error.message()));
    } catch (const stream::Error& error) {
      // The message would begin with the region's text or with "the region"; replaces that by the
      // option.
      stream::Error::Parts parts = error.parts();
      parts.file =
          parts.file.empty() || text.starts_with(parts.file) ? name : name + ": " + parts.file;
      if (parts.where == "the region") parts.where.clear();
      throw stream::Error(std::move(parts));
    }
  }
  return detail;
}

std::optional<unsigned> parse_level(const std::string& text) {
  if (text == "top") return std::nullopt;
  const auto level = number_from<unsigned>(text);
  if (!level || *level > 255) {
    throw UsageError(
        fmt::format("'{}' is not a level; write a number from 0 (full detail) or 'top'", text));
  }
  return level;
}

stream::ClusterId parse_cluster(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (colon != std::string::npos) {
    const auto level = number_from<unsigned>(text.substr(0, colon));
    const auto number = number_from<std::uint64_t>(text.substr(colon + 1));
    if (level && *level < 256 && number && *number < base::kClusterOrdinalEnd) {
      return stream::cluster_id(*level, *number);
    }
  }
  throw UsageError("--cluster '" + text +
                   "': write L:N, its level and its number in that level, as in 1:42");
}

Focus parse_focus(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) throw UsageError("names no level; write BOX:L");
  return {.region = Region::parse(text.substr(0, colon), stop_token()),
          .level = parse_level(text.substr(colon + 1))};
}

Line parse_line(const std::string& text) {
  const auto line_error = [&](const std::string& cause) {
    return stream::Error(text, cause)
        .remedy("give x1,y1,x2,y2,... or a GeoJSON file with one LineString");
  };
  Line line;
  if (text.find(',') != std::string::npos &&
      text.find_first_not_of("0123456789+-.,eE ") == std::string::npos) {
    const std::vector<double> numbers = parse_numbers(text, "--line");
    if (numbers.size() < 4 || numbers.size() % 2 != 0) {
      throw UsageError("--line has " + counted(numbers.size(), "number") +
                       "; write x1,y1,x2,y2 and any further pairs");
    }
    for (std::size_t i = 0; i < numbers.size(); i += 2) {
      line.places.push_back({numbers[i], numbers[i + 1]});
    }
    return line;
  }
  const auto json = json_of_file(text, kMaxGeoJsonBytes, convert_to_geojson(text), stop_token());
  if (!json) throw line_error("is neither a list of places nor a readable file");
  std::vector<std::vector<Point2>> lines;
  try {
    collect_line_strings(*json, 0, lines);
    line.crs = crs_of_geojson(*json, text);
  } catch (const nlohmann::json::exception& error) {
    throw line_error(fmt::format("is not GeoJSON ({})", error.what()));
  }
  if (lines.size() != 1) throw line_error(fmt::format("holds {}", counted(lines.size(), "line")));
  if (lines.front().size() < 2) throw line_error("the line has fewer than two places");
  line.places = std::move(lines.front());
  return line;
}

std::optional<tri::SmoothingOptions> parse_smoothing(const std::string& text) {
  return parse_steps<tri::SmoothingOptions, tri::Smoothing>(
      text, {{"laplacian", tri::Smoothing::laplacian},
             {"taubin", tri::Smoothing::taubin},
             {"bilateral", tri::Smoothing::bilateral}});
}

std::optional<tri::SurfaceSmoothingOptions> parse_surface_smoothing(const std::string& text) {
  return parse_steps<tri::SurfaceSmoothingOptions, tri::SurfaceSmoothing>(
      text,
      {{"taubin", tri::SurfaceSmoothing::taubin}, {"bilateral", tri::SurfaceSmoothing::bilateral}});
}

}  // namespace terrace::tools
