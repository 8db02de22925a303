// SPDX-License-Identifier: GPL-3.0-or-later
// info: describes a store or a file.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "base/stored_entities.hpp"
#include "base/units.hpp"
#include "cli/cli.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_names.hpp"
#include "cli/terminal.hpp"
#include "earth/crs/datum_change.hpp"
#include "earth/crs/definition.hpp"
#include "earth/source_crs.hpp"
#include "tables/point_table.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/source.hpp"
#include "terrace/stream/store.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/undeclared_voids.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

using Json = nlohmann::ordered_json;

/// Returns {"min": [x, y, z], "max": [x, y, z]}, or null for an empty box.
Json box_json(const stream::Box3& box) {
  if (box.empty()) return nullptr;
  Json json;
  json["min"] = box.min;
  json["max"] = box.max;
  return json;
}

/// Returns the text, or null if it is empty.
Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

/// Returns the CRS as in docs/reference/json.md, with null for unknown values.
Json crs_json(const stream::Crs& crs) {
  if (crs == stream::Crs{}) return nullptr;
  Json json;
  json["epsg"] = crs.epsg == 0 ? Json(nullptr) : Json(crs.epsg);
  json["name"] = text_or_null(crs.name);
  json["wkt"] = text_or_null(crs.wkt);
  json["geographic"] = crs.geographic;
  json["horizontal_unit"] = text_or_null(crs.horizontal_unit);
  json["vertical_epsg"] = crs.vertical_epsg == 0 ? Json(nullptr) : Json(crs.vertical_epsg);
  json["vertical_unit"] = text_or_null(crs.vertical_unit);
  return json;
}

/// Adds the extent of the points, the CRS, and the lattice of a raster.
void add_placement(const stream::Schema& schema, const stream::Box3& bounds, const stream::Crs& crs,
                   const std::string& vertical, Json& json) {
  json["bounds"] = box_json(bounds);
  json["crs"] = crs_json(crs);
  json["vertical"] = text_or_null(vertical);
  if (schema.grid) {
    json["columns"] = schema.columns;
    json["rows"] = schema.rows;
  }
  if (schema.grid || schema.world != stream::WorldTransform{}) json["transform"] = schema.world.xy;
}

Json channels_of(const stream::Schema& schema) {
  Json list = Json::array();
  const auto add = [&](const stream::Channel& channel) {
    list.push_back({{"name", channel.name},
                    {"type", stream::name_of(channel.type)},
                    {"scale", channel.scale},
                    {"offset", channel.offset},
                    {"unit", channel.unit}});
  };
  for (const stream::Channel& channel : schema.coordinates) add(channel);
  for (const stream::Channel& channel : schema.attributes) add(channel);
  return list;
}

/// Returns "EPSG:32632 (WGS 84 / UTM zone 32N)" or "unknown", followed by the operation to WGS 84
/// that applies within `bounds`, a box in the CRS.
std::string crs_text(const stream::Crs& crs, const stream::Box3& bounds) {
  std::string text = crs.epsg != 0 ? fmt::format("EPSG:{}", crs.epsg) : "";
  if (!crs.name.empty()) text += text.empty() ? crs.name : fmt::format(" ({})", crs.name);
  if (text.empty()) text = crs.wkt.empty() ? "unknown" : crs.wkt.substr(0, 60) + "...";
  if (crs.vertical_epsg != 0) text += fmt::format(" + EPSG:{}", crs.vertical_epsg);
  try {
    const std::optional<CrsDefinition> definition = definition_of(crs);
    if (!definition) return text;
    const CoordinateSystem system = CoordinateSystem(*definition).over(bounds);
    const DatumChange& change = system.to_wgs84();
    if (!change.possible()) {
      text += fmt::format(", datum {} without a transformation to WGS 84", definition->datum);
      if (!change.better().empty()) text += fmt::format(": {}", change.better());
    } else if (!change.identity()) {
      text += fmt::format(", to WGS 84 by {}", change.description());
    } else if (change.accuracy().value_or(0) > 0) {
      text += fmt::format(", within {} m of WGS 84", plain_number(*change.accuracy()));
      if (!change.better().empty()) text += fmt::format(" ({})", change.better());
    }
  } catch (const CrsError& error) {
    text += std::string(", ") + error.what();
  }
  return text;
}

/// Returns "1.5 2 3  to  4 5 6" or "none".
std::string box_text(const stream::Box3& box) {
  if (box.empty()) return "none";
  const auto corner = [](const stream::Point3& p) {
    // Precise to a nanodegree, or a millimetre of projected coordinates.
    return readable_number(p[0], 10) + ' ' + readable_number(p[1], 10) + ' ' +
           readable_number(p[2], 10);
  };
  return corner(box.min) + "  to  " + corner(box.max);
}

/// Returns "height int16 (metre)", with scale and offset if they are not 1 and 0.
std::string channel_text(const stream::Channel& channel) {
  std::string text = channel.name + ' ' + std::string(stream::name_of(channel.type));
  if (channel.scale != 1) text += fmt::format(" x {}", plain_number(channel.scale));
  if (channel.offset != 0) text += fmt::format(" + {}", plain_number(channel.offset));
  if (!channel.unit.empty()) text += fmt::format(" ({})", channel.unit);
  return text;
}

std::string raster_line(const stream::Schema& schema) {
  return fmt::format("raster:    {} x {} cells of {}\n", schema.columns, schema.rows,
                     channel_text(schema.coordinates[2]));
}

std::string heights_line(double low, double high, double mean) {
  return fmt::format("heights:   {} to {}, mean {}\n", readable_number(low, 6),
                     readable_number(high, 6), readable_number(mean, 6));
}

std::string channels_line(const stream::Schema& schema) {
  std::string text = "channels: ";
  for (const stream::Channel& c : schema.coordinates)
    text += ' ' + printable_line(channel_text(c)) + ',';
  for (const stream::Channel& c : schema.attributes)
    text += ' ' + printable_line(channel_text(c)) + ',';
  text.back() = '\n';
  return text;
}

/// Compensated sum of doubles, so that the mean of a billion heights is exact in its last digits
/// (A. Neumaier 1974, doi:10.1002/zamm.19740540106).
class CompensatedSum {
 public:
  void add(double value) {
    const double sum = sum_ + value;
    compensation_ +=
        std::abs(sum_) >= std::abs(value) ? (sum_ - sum) + value : (value - sum) + sum_;
    sum_ = sum;
  }
  [[nodiscard]] double value() const { return sum_ + compensation_; }

 private:
  double sum_ = 0, compensation_ = 0;
};

/// Counts and extent of all points of a source.
struct SourceScan {
  std::uint64_t points = 0, nodata = 0, empty_values = 0, withheld = 0;
  stream::Box3 stored, world;  ///< bounding boxes, in stored coordinates and in the CRS
  double mean_height = 0;      ///< mean height, stored
  std::string note;            ///< about heights, or empty
};

/// Reads a source to its end. Throws what for_each_block() throws.
SourceScan scan_points(stream::PointSource& source, const CommonOptions& common) {
  const stream::SourceInfo& info = source.info();
  const stream::Placement& placement = info;
  // Without rotation, the stored box maps to the box in the CRS, so only the box is transformed.
  const bool unrotated = info.world.xy[1] == 0 && info.world.xy[3] == 0;
  SourceScan scan;
  CompensatedSum heights;
  UndeclaredVoids voids(info);
  for_each_block(source, common, [&](const stream::PointBlock& block) {
    for (const stream::Point3& p : block.positions) {
      scan.stored.include(p);
      heights.add(p[2]);
      if (!unrotated) scan.world.include(world_point(placement, p));
    }
    scan.points += block.size();
    voids.add(block);
  });
  scan.note = option_text(voids.note());
  scan.nodata = source.progress().nodata;
  scan.empty_values = source.progress().empty_values;
  scan.withheld = source.progress().withheld;
  if (unrotated) scan.world = world_box(placement, scan.stored);
  if (scan.points > 0) scan.mean_height = heights.value() / static_cast<double>(scan.points);
  return scan;
}

/// Returns the size of the files; for EPT, of all files in its folder. nullopt for pipes.
std::optional<std::uint64_t> bytes_of(const stream::SourceInfo& info) {
  namespace fs = std::filesystem;
  std::uint64_t bytes = 0;
  for (const std::string& file : info.files) {
    std::error_code error;
    if (!fs::is_regular_file(file, error)) return std::nullopt;
    if (info.format != "ept") {
      bytes += fs::file_size(file, error);
      continue;
    }
    fs::recursive_directory_iterator at(fs::absolute(file).parent_path(), error);
    for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
      if (at->is_regular_file(error)) bytes += at->file_size(error);
    }
  }
  return bytes;
}

/// Percentiles and mean of the sizes of a level's clusters. A size includes the representative.
struct ClusterSizes {
  std::uint64_t min = 0, p5 = 0, median = 0, p95 = 0, max = 0;
  double mean = 0;
};

/// Returns the sizes of a level's clusters.
ClusterSizes sizes_of_clusters(const stream::Store& store, const stream::LevelInfo& level) {
  // Sample at most this many clusters of a level.
  constexpr std::uint64_t kMaxClusters = 200000;
  const std::uint64_t stride = level.clusters / kMaxClusters + 1;
  const std::uint64_t representative = level.level == store.top() ? 0 : 1;
  std::vector<std::uint64_t> sizes;
  for (std::uint64_t i = 0; i < level.clusters; i += stride) {
    check_interrupt();
    sizes.push_back(store.record(stream::cluster_id(level.level, i)).points + representative);
  }
  ClusterSizes result;
  if (sizes.empty()) return result;
  std::sort(sizes.begin(), sizes.end());
  const auto percentile = [&](std::size_t percent) {
    return sizes[(sizes.size() - 1) * percent / 100];
  };
  result.min = sizes.front();
  result.p5 = percentile(5);
  result.median = percentile(50);
  result.p95 = percentile(95);
  result.max = sizes.back();
  std::uint64_t sum = 0;
  for (const std::uint64_t size : sizes) sum += size;
  result.mean = static_cast<double>(sum) / static_cast<double>(sizes.size());
  return result;
}

/// The description of files that `info` prints.
struct FileInfo {
  const stream::SourceInfo& source;
  SourceScan scan;
  SourceCrs crs;
  std::optional<std::uint64_t> bytes;  ///< see bytes_of()
  std::vector<std::string> comments;

  [[nodiscard]] std::string vertical() const {
    return crs.heights == Heights::unknown ? "" : name_of(crs.heights);
  }
};

/// Returns the CRS of a source. An error that would make a build fail becomes a note, so that it is
/// reported along with the rest of the file.
SourceCrs crs_with_note(const stream::SourceInfo& info) {
  try {
    return crs_of_source(info);
  } catch (const CrsDatabaseError&) {
    throw;
  } catch (const stream::Error& error) {
    SourceCrs crs;
    crs.crs = info.crs;
    crs.note = error.message();
    return crs;
  }
}

Json file_json(const FileInfo& file) {
  const stream::SourceInfo& info = file.source;
  const SourceScan& scan = file.scan;
  Json json;
  json["format"] = info.format;
  json["files"] = info.files.size();
  json["version"] = nullptr;
  json["points"] = scan.points;
  json["nodata"] = scan.nodata;
  if (scan.empty_values > 0) json["empty_values"] = scan.empty_values;
  if (scan.withheld > 0) json["withheld"] = scan.withheld;
  if (info.octree) {
    json["octree"] = {{"spacing", info.octree->spacing},
                      {"depths", info.octree->depths},
                      {"nodes", info.octree->nodes}};
  }
  json["levels"] = Json::array();
  add_placement(info, scan.world, file.crs.crs, file.vertical(), json);
  if (info.grid) json["nodata_value"] = or_null(info.nodata);
  json["height"] = nullptr;
  if (scan.points > 0) {
    const stream::Channel& z = info.coordinates[2];
    const auto to_height = [&z](double raw) { return raw * z.scale + z.offset; };
    const auto [low, high] =
        std::minmax({to_height(scan.stored.min[2]), to_height(scan.stored.max[2])});
    json["height"] = {{"min", low}, {"max", high}, {"mean", to_height(scan.mean_height)}};
  }
  json["channels"] = channels_of(info);
  json["parameters"] = Json::object();
  json["comments"] = file.comments;
  json["bytes"] = file.bytes ? Json(*file.bytes) : Json(nullptr);
  return json;
}

/// Returns the lines on the format, the cells of a raster and the points.
std::string contents_lines(const FileInfo& file) {
  const stream::SourceInfo& info = file.source;
  const SourceScan& scan = file.scan;
  std::string text = fmt::format("format:    {}", info.format);
  if (info.files.size() > 1) text += fmt::format(", {}", counted(info.files.size(), "file"));
  if (file.bytes) text += fmt::format(", {}", readable_bytes(*file.bytes));
  text += '\n';
  if (info.grid) {
    text += raster_line(info);
    text += fmt::format("cell:      {} {}\n", readable_number(info.world.xy[0], 10),
                        readable_number(info.world.xy[4], 10));
    text += fmt::format("nodata:    {}{}\n", counted(scan.nodata, "cell"),
                        info.nodata ? fmt::format(", value {}", plain_number(*info.nodata)) : "");
  }
  text += fmt::format("points:    {}{}\n", with_commas(scan.points),
                      !info.grid && scan.nodata > 0
                          ? fmt::format(", and {} without coordinates", with_commas(scan.nodata))
                          : std::string());
  if (info.octree) {
    text += fmt::format("octree:    {} at {}, spacing {} at the root\n",
                        counted(info.octree->nodes, "node"), counted(info.octree->depths, "depth"),
                        readable_number(info.octree->spacing, 6));
  }
  if (scan.empty_values > 0) {
    text +=
        "empty:     " + counted(scan.empty_values, "attribute") + " without a value, read as NaN\n";
  }
  if (scan.withheld > 0) text += fmt::format("withheld:  {}\n", counted(scan.withheld, "point"));
  return text;
}

/// Returns the text for people. `height` is the value of that name in file_json().
std::string file_text(const FileInfo& file, const Json& height) {
  std::string text = contents_lines(file);
  text += "crs:       " + printable_line(crs_text(file.crs.crs, file.scan.world)) + '\n';
  if (!file.crs.note.empty()) {
    text += "note:      " + printable_line(option_text(file.crs.note)) + '\n';
  }
  if (const std::string vertical = file.vertical(); !vertical.empty()) {
    text += "vertical:  " + vertical + '\n';
  }
  text += "bounds:    " + box_text(file.scan.world) + '\n';
  if (!height.is_null()) text += heights_line(height["min"], height["max"], height["mean"]);
  text += channels_line(file.source);
  for (const std::string& comment : file.comments) {
    text += "comment:   " + printable_line(comment) + '\n';
  }
  return text;
}

/// Describes files of points or cells by streaming them once. Throws stream::Error.
Summary info_of_files(std::span<const std::string> files, const std::string& format,
                      stream::HeightsOfColour colours, const CommonOptions& common) {
  const std::unique_ptr<stream::PointSource> source =
      stream::open_source(files, {.format = format,
                                  .memory_bytes = common.reading_memory(),
                                  .heights_of_colour = colours,
                                  .same_crs = &terrain::same_crs,
                                  .stop = stop_token(),
                                  .blocks_ahead = 8,
                                  .threads = common.threads});
  reading_within_memory(*source, common.memory_or(0));
  SourceScan scan = scan_points(*source, common);
  const stream::SourceInfo& info = source->info();
  std::vector<std::string> comments = info.comments;
  if (!scan.note.empty()) comments.push_back(scan.note);
  const FileInfo file{.source = info,
                      .scan = std::move(scan),
                      .crs = crs_with_note(info),
                      .bytes = bytes_of(info),
                      .comments = std::move(comments)};
  Summary summary;
  summary.text_is_result = true;
  summary.json = file_json(file);
  summary.text = file_text(file, summary.json["height"]);
  return summary;
}

/// Adds the levels of a store, as a JSON list and as a table.
void add_levels(const stream::Store& store, Json& json, std::string& text) {
  text += "level          points    clusters        bytes   cluster sizes: 5 %  median   95 %\n";
  for (const stream::LevelInfo& level : store.levels()) {
    const ClusterSizes sizes = sizes_of_clusters(store, level);
    json.push_back({{"level", level.level},
                    {"points", level.points},
                    {"clusters", level.clusters},
                    {"bytes", level.bytes},
                    {"members", level.members},
                    {"index_bytes", level.index_bytes},
                    {"segments", level.segments},
                    {"cluster_sizes",
                     {{"min", sizes.min},
                      {"p5", sizes.p5},
                      {"median", sizes.median},
                      {"p95", sizes.p95},
                      {"max", sizes.max},
                      {"mean", sizes.mean}}}});
    text += fmt::format("{:>5}{:>16}{:>12}{:>13}{:>20}{:>8}{:>7}\n", level.level,
                        with_commas(level.points), with_commas(level.clusters),
                        readable_bytes(level.bytes), sizes.p5, sizes.median, sizes.p95);
  }
}

/// Describes a store from its manifest and indices. Throws stream::Error.
Summary info_of_store(const std::string& path) {
  const stream::Store store = open_store(path);
  const stream::StoreSchema& schema = store.schema();
  const stream::Placement& placement = schema;
  const stream::Box3 bounds = world_box(placement, store.bounds());
  const stream::Channel& z = schema.coordinates[2];
  const double mean = store.mean_height() * z.scale + z.offset;

  Summary summary;
  summary.text_is_result = true;
  Json& json = summary.json;
  json["format"] = "terrace";
  json["version"] = store.version();
  json["source_format"] = schema.format;
  json["points"] = store.points();
  json["nodata"] = schema.nodata;
  json["levels"] = Json::array();
  add_placement(schema, bounds, schema.crs, schema.vertical, json);
  json["height"] = {{"min", bounds.min[2]}, {"max", bounds.max[2]}, {"mean", mean}};
  json["channels"] = channels_of(schema);
  json["parameters"] = Json::object();
  for (const auto& [name, value] : schema.parameters) json["parameters"][name] = value;
  json["bytes"] = store.bytes();
  if (const auto surface = store.surface()) {
    json["surface"] = {{"vertices", surface->vertices},
                       {"triangles", surface->triangles},
                       {"bytes", surface->bytes}};
  }

  std::string& text = summary.text;
  text += fmt::format("format:    terrace store, version {}, {} (from {})\n", store.version(),
                      readable_bytes(store.bytes()), schema.format);
  if (schema.grid) text += raster_line(schema);
  text += fmt::format("points:    {}, nodata {}\n", with_commas(store.points()),
                      with_commas(schema.nodata));
  text += "crs:       " + printable_line(crs_text(schema.crs, bounds)) + '\n';
  text +=
      "vertical:  " + (schema.vertical.empty() ? std::string("unknown") : schema.vertical) + '\n';
  text += fmt::format("bounds:    {}", box_text(bounds));
  if (entities_of(schema) != stream::Entities::points) text += " (first corner of each entity)";
  text += '\n';
  text += heights_line(bounds.min[2], bounds.max[2], mean);
  text += channels_line(schema);
  if (const auto surface = store.surface()) {
    text += fmt::format("surface:   {}, {}, {}\n", counted(surface->vertices, "vertex"),
                        counted(surface->triangles, "triangle"), readable_bytes(surface->bytes));
  }
  for (const auto& [name, value] : schema.parameters)
    text += "parameter: " + printable_line(name + ' ' + value) + '\n';
  add_levels(store, json["levels"], text);
  return summary;
}

class InfoCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("input", inputs_,
                   "a store, or one or more files of points or cells: paths, folders, quoted "
                   "patterns, @FILE with one name per line, or - for standard input")
        ->required()
        ->type_name("STORE|FILE");
    add_input_format(app, format_);
    add_rgb_encoding(app, colours_);
  }

  Summary run(const CommonOptions& common) override {
    for (const std::string& input : inputs_) {
      if (!stream::Store::exists(input)) continue;
      if (inputs_.size() > 1) {
        throw UsageError(fmt::format("'{}' is a store: pass it alone", input));
      }
      if (colours_ != stream::HeightsOfColour::none || !format_.empty()) {
        throw UsageError(
            fmt::format("'{}' is a store: --rgb and --input-format do not apply", input));
      }
      return info_of_store(input);
    }
    return info_of_files(inputs_, format_, colours_, common);
  }

 private:
  std::vector<std::string> inputs_;
  std::string format_;
  stream::HeightsOfColour colours_ = stream::HeightsOfColour::none;
};

}  // namespace

std::unique_ptr<Command> make_info() { return std::make_unique<InfoCommand>(); }

}  // namespace terrace::tools
