// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/terminal.hpp"
#include "terrace/stream/store.hpp"
#include "verbs/info.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// Sizes of a level's clusters, representative included: 0, 5, 50, 95 and 100 percentiles.
struct Sizes {
  std::array<std::uint64_t, 5> percentiles{};
  double mean = 0;
};

Sizes sizes_of(const stream::Store& store, const stream::LevelInfo& level) {
  // Every n-th cluster is enough for a level that has very many.
  constexpr std::uint64_t kMost = 200000;
  const std::uint64_t stride = level.clusters / kMost + 1;
  const std::uint64_t representative = level.level == store.top() ? 0 : 1;
  std::vector<std::uint64_t> sizes;
  for (std::uint64_t i = 0; i < level.clusters; i += stride) {
    check_interrupt();
    sizes.push_back(store.record(stream::cluster_id(level.level, i)).points + representative);
  }
  Sizes result;
  if (sizes.empty()) return result;
  std::sort(sizes.begin(), sizes.end());
  constexpr std::array<std::size_t, 5> kPercent{0, 5, 50, 95, 100};
  for (std::size_t k = 0; k < kPercent.size(); ++k) {
    result.percentiles[k] = sizes[(sizes.size() - 1) * kPercent[k] / 100];
  }
  std::uint64_t sum = 0;
  for (const std::uint64_t size : sizes) sum += size;
  result.mean = static_cast<double>(sum) / static_cast<double>(sizes.size());
  return result;
}

std::string padded(const std::string& text, std::size_t width) {
  return std::string(width - std::min(width, text.size()), ' ') + text;
}

}  // namespace

Summary info_of_store(const std::string& path, const CommonOptions& common) {
  static_cast<void>(common);
  const stream::Store store = open_store(path);
  const stream::StoreSchema& schema = store.schema();
  const stream::Placement& placement = schema;
  const stream::Box3 bounds = world_box(placement, store.bounds());
  const stream::Channel& z = schema.coordinates[2];
  const double mean = store.mean_height() * z.scale + z.offset;

  Summary summary;
  summary.text_is_result = true;
  nlohmann::ordered_json& json = summary.json;
  json["format"] = "terrace";
  json["version"] = store.version();
  json["source_format"] = schema.format;
  json["points"] = store.points();
  json["nodata"] = schema.nodata;
  json["levels"] = nlohmann::ordered_json::array();
  json["bounds"] = json_of(bounds);
  json["crs"] = json_of(schema.crs);
  json["vertical"] = schema.vertical.empty() ? nlohmann::ordered_json(nullptr)
                                             : nlohmann::ordered_json(schema.vertical);
  if (schema.grid) {
    json["columns"] = schema.columns;
    json["rows"] = schema.rows;
    json["transform"] = schema.world.xy;
  } else if (schema.world != stream::WorldTransform{}) {
    json["transform"] = schema.world.xy;
  }
  json["height"] = {{"min", bounds.min[2]}, {"max", bounds.max[2]}, {"mean", mean}};
  json["channels"] = nlohmann::ordered_json::array();
  for (const stream::Channel& c : schema.coordinates) json["channels"].push_back(json_of(c));
  for (const stream::Channel& c : schema.attributes) json["channels"].push_back(json_of(c));
  json["parameters"] = nlohmann::ordered_json::object();
  for (const auto& [name, value] : schema.parameters) json["parameters"][name] = value;
  json["bytes"] = store.bytes();

  std::string& text = summary.text;
  text += "format:    terrace store, version " + std::to_string(store.version()) + ", " +
          readable_bytes(store.bytes()) + " (from " + schema.format + ")\n";
  if (schema.grid) {
    text += "raster:    " + std::to_string(schema.columns) + " x " + std::to_string(schema.rows) +
            " cells of " + text_of(z) + '\n';
  }
  text +=
      "points:    " + with_commas(store.points()) + ", nodata " + with_commas(schema.nodata) + '\n';
  text += "crs:       " + printable_line(text_of(schema.crs, bounds)) + '\n';
  text +=
      "vertical:  " + (schema.vertical.empty() ? std::string("unknown") : schema.vertical) + '\n';
  text += "bounds:    " + text_of(bounds) + '\n';
  text += "heights:   " + readable_number(bounds.min[2], 6) + " to " +
          readable_number(bounds.max[2], 6) + ", mean " + readable_number(mean, 6) + '\n';
  text += "channels: ";
  for (const stream::Channel& c : schema.coordinates)
    text += ' ' + printable_line(text_of(c)) + ',';
  for (const stream::Channel& c : schema.attributes) text += ' ' + printable_line(text_of(c)) + ',';
  text.back() = '\n';
  for (const auto& [name, value] : schema.parameters)
    text += "parameter: " + printable_line(name + ' ' + value) + '\n';
  text += "level          points    clusters        bytes   cluster sizes: 5 %  median   95 %\n";
  for (const stream::LevelInfo& level : store.levels()) {
    const Sizes sizes = sizes_of(store, level);
    json["levels"].push_back({{"level", level.level},
                              {"points", level.points},
                              {"clusters", level.clusters},
                              {"bytes", level.bytes},
                              {"members", level.members},
                              {"index_bytes", level.index_bytes},
                              {"cluster_sizes",
                               {{"min", sizes.percentiles[0]},
                                {"p5", sizes.percentiles[1]},
                                {"median", sizes.percentiles[2]},
                                {"p95", sizes.percentiles[3]},
                                {"max", sizes.percentiles[4]},
                                {"mean", sizes.mean}}}});
    text += padded(std::to_string(level.level), 5) + padded(with_commas(level.points), 16) +
            padded(with_commas(level.clusters), 12) + padded(readable_bytes(level.bytes), 13) +
            padded(std::to_string(sizes.percentiles[1]), 20) +
            padded(std::to_string(sizes.percentiles[2]), 8) +
            padded(std::to_string(sizes.percentiles[3]), 7) + '\n';
  }
  return summary;
}

}  // namespace terrace::tools
