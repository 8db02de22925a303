// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/choices.hpp"

#include <initializer_list>
#include <string_view>
#include <utility>

#include "terrace/terrain/error.hpp"

namespace terrace::tools {
namespace {

template <class T>
T choice(const std::string& text, const char* option,
         std::initializer_list<std::pair<std::string_view, T>> choices) {
  std::string names;
  for (const auto& [name, value] : choices) {
    if (name == text) return value;
    names += (names.empty() ? "" : ", ") + std::string(name);
  }
  throw UsageError(std::string(option) + " '" + text + "': one of " + names);
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
                                 {{"greedy", tri::TinQuality::kGreedy},
                                  {"removal", tri::TinQuality::kRemoval},
                                  {"fitted", tri::TinQuality::kFitted}});
}

tri::PointDuplicates parse_duplicates(const std::string& text) {
  return choice<tri::PointDuplicates>(text, "--duplicates",
                                      {{"all", tri::PointDuplicates::kAll},
                                       {"min", tri::PointDuplicates::kMin},
                                       {"max", tri::PointDuplicates::kMax},
                                       {"mean", tri::PointDuplicates::kMean},
                                       {"first", tri::PointDuplicates::kFirst},
                                       {"error", tri::PointDuplicates::kError}});
}

tri::Interpolation parse_interpolation(const std::string& text) {
  return choice<tri::Interpolation>(text, "--method",
                                    {{"linear", tri::Interpolation::kLinear},
                                     {"natural", tri::Interpolation::kNaturalNeighbour},
                                     {"nearest", tri::Interpolation::kNearest}});
}

RasterValue parse_raster_value(const std::string& text) {
  return choice<RasterValue>(text, "--value",
                             {{"height", RasterValue::height},
                              {"slope", RasterValue::slope},
                              {"aspect", RasterValue::aspect},
                              {"hillshade", RasterValue::hillshade}});
}

}  // namespace terrace::tools
