// SPDX-License-Identifier: GPL-3.0-or-later
#include "mesh/bounded/bounded_mesh.hpp"

#include <array>
#include <string_view>
#include <utility>

#include <terrace/stream/error.hpp>

#include "base/units.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

template <class T, std::size_t N>
T choice(const std::string& text, const char* option,
         const std::array<std::pair<std::string_view, T>, N>& choices) {
  std::string names;
  for (const auto& [name, value] : choices) {
    if (name == text) return value;
    names += (names.empty() ? "" : ", ") + std::string(name);
  }
  throw UsageError(std::string(option) + " '" + text + "': one of " + names);
}

}  // namespace

Fill parse_fill(const std::string& text) {
  constexpr std::array<std::pair<std::string_view, Fill>, 3> kChoices{
      {{"none", Fill::none}, {"flat", Fill::flat}, {"interpolate", Fill::interpolate}}};
  return choice(text, "--fill", kChoices);
}

double aim_within(double bound, const stream::MeshRounding& rounding, const std::string& path) {
  const stream::Point3& moved = rounding.largest();
  if (moved == stream::Point3{}) return bound;
  const double aim = bound * (15.0 / 16.0) - moved[2];
  if (!(aim >= 0.0)) {
    throw stream::Error({.file = path,
                         .where = {},
                         .cause = "its format rounds heights by up to " +
                                  readable_number(moved[2]) + ", too much for this --max-error",
                         .remedy = "write PLY, which is exact"});
  }
  return aim;
}

tri::TinQuality parse_quality(const std::string& text) {
  constexpr std::array<std::pair<std::string_view, tri::TinQuality>, 3> kChoices{
      {{"greedy", tri::TinQuality::kGreedy},
       {"removal", tri::TinQuality::kRemoval},
       {"fitted", tri::TinQuality::kFitted}}};
  return choice(text, "--quality", kChoices);
}

tri::PointDuplicates parse_duplicates(const std::string& text) {
  constexpr std::array<std::pair<std::string_view, tri::PointDuplicates>, 6> kChoices{
      {{"all", tri::PointDuplicates::kAll},
       {"min", tri::PointDuplicates::kMin},
       {"max", tri::PointDuplicates::kMax},
       {"mean", tri::PointDuplicates::kMean},
       {"first", tri::PointDuplicates::kFirst},
       {"error", tri::PointDuplicates::kError}}};
  return choice(text, "--duplicates", kChoices);
}

}  // namespace terrace::terrain
