// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/store_options.hpp"

#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <fmt/format.h>

#include "base/units.hpp"
#include "cli/cli.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "cli/selection_options.hpp"

namespace terrace::tools {

using namespace terrain;

std::optional<Transformation> CrsOptions::from_store_to_input(const stream::Store& store,
                                                              const CommonOptions& common) const {
  if (input_crs_.empty()) return std::nullopt;
  Transformation transformation =
      transformation_to(store, input_crs_, parse_datum_shift(datum_shift_));
  if (!transformation.note().empty() && transformation.note() != noted_) {
    common.say(noted_ = transformation.note());
  }
  return transformation;
}

RegionConversion CrsOptions::regions(const stream::Store& store,
                                     const CommonOptions& common) const {
  std::optional<Transformation> input = from_store_to_input(store, common);
  RegionConversion regions = input ? RegionConversion(store, std::move(*input))
                                   : RegionConversion(store, parse_datum_shift(datum_shift_));
  regions.on_note([&common](const std::string& line) { common.say(line); });
  return regions;
}

PlaceConversion CrsOptions::places(const stream::Store& store, const CommonOptions& common) const {
  std::optional<Transformation> output = from_store_to_output(store, common);
  return output ? PlaceConversion(std::move(*output), store) : PlaceConversion();
}

std::optional<Transformation> CrsOptions::from_input_to_output(
    const stream::Store& store, const CommonOptions& common,
    const std::optional<Transformation>& input) const {
  if (output_crs_.empty()) return std::nullopt;
  Transformation output = transformation_to(store, output_crs_, parse_datum_shift(datum_shift_));
  if (input) output = Transformation(input->to(), output.to());
  if (!output.note().empty()) common.say(output.note());
  return output;
}

std::optional<Transformation> CrsOptions::from_store_to_output(const stream::Store& store,
                                                               const CommonOptions& common) const {
  std::optional<Transformation> output = from_input_to_output(store, common);
  if (output && output->identity()) output.reset();
  return output;
}

void CrsOptions::define(CLI::App& app, const std::string& name, const std::string& subject) {
  define_input(app, name, subject);
  app.add_option("--to-crs", output_crs_, "CRS of the output; heights stay as they are");
}

void CrsOptions::define_input(CLI::App& app, const std::string& name, const std::string& subject) {
  app.add_option(name, input_crs_,
                 "CRS of " + subject +
                     ": EPSG:n or a WKT file; x,y is lon,lat (default: the store's; for GeoJSON "
                     "the one that the file names, or else longitude and latitude)");
  app.add_option("--towgs84", datum_shift_,
                 "dx,dy,dz[,rx,ry,rz,ds] to WGS 84 from the datum of that CRS, or of the store if "
                 "only that is not WGS 84");
}

namespace {

/// Adds --level and --focus.
void add_levels(CLI::App& app, std::string& level, std::vector<std::string>& focuses) {
  app.add_option("--level", level,
                 "points of this level and above, outside the focuses; a number or top")
      ->default_str("0; with --focus top");
  app.add_option("--focus", focuses, "BOX:L, all points of level L inside the box; repeatable")
      ->allow_extra_args(false);
}

}  // namespace

void PartOptions::define(CLI::App& app, const std::string& region_effect) {
  app.add_option("STORE", path, "the store to read")->required();
  add_levels(app, level, focuses);
  app.add_option("--region", region,
                 region_effect + ": a box, minx,miny[,minz],maxx,maxy[,maxz], or a GeoJSON file");
  add_where(app, where);
  crs.define(app);
}

CLI::Option* PartOptions::define_cluster(CLI::App& app, const std::string& cluster_effect) {
  return app
      .add_option("--cluster", cluster,
                  "L:N, the cluster N of level L: " + cluster_effect + ", including its own point")
      ->excludes("--region")
      ->excludes("--focus");
}

Detail PartOptions::detail(const stream::Store& store, const CommonOptions& common) const {
  Detail detail = parse_detail(store, level, region, focuses, crs.regions(store, common));
  note_idle_focuses(store, detail, common.context());
  if (cluster.empty()) return detail;
  detail.cluster = parse_cluster(cluster);
  if (level.empty()) detail.level = stream::level_of(*detail.cluster);
  return detail;
}

void SurfaceOptions::define(CLI::App& app) {
  define_triangles(app);
  app.add_option("--method", method,
                 "linear: on the triangulated points; natural: natural neighbours, smooth; "
                 "nearest: the nearest point")
      ->capture_default_str()
      ->type_name("NAME");
}

void SurfaceOptions::define_triangles(CLI::App& app) {
  app.add_option("STORE", path, "the store to read")->required();
  add_levels(app, level, focuses);
  add_number(
      app, "--max-edge", max_edge,
      "irregular points and coarser levels: triangles with a side longer than this, in metres on "
      "the ground, count as no data, as over water and in shadows (default: no limit)",
      kPositive)
      ->type_name("METRES");
  add_number(app, "--max-error", max_error,
             "instead of a level: a surface of few triangles, within this many metres of every "
             "sample, vertically",
             kNonNegative)
      ->type_name("METRES")
      ->excludes("--level")
      ->excludes("--focus")
      ->excludes("--max-edge");
  add_where(app, where);
}

stream::Store SurfaceOptions::open(SamplerOptions& sampler) const {
  sampler.method = parse_interpolation(method);
  sampler.max_error = max_error;
  sampler.max_edge = max_edge;
  if (!level.empty()) static_cast<void>(parse_level(level));
  return open_store(path, where);
}

Detail SurfaceOptions::detail(const stream::Store& store, const CrsOptions& crs,
                              const CommonOptions& common, const std::string& region) const {
  // Without places in the request, the CRS of the store need not be known.
  if (region.empty() && focuses.empty()) {
    return {.level = level.empty() ? 0 : parse_level(level).value_or(store.top())};
  }
  Detail detail = parse_detail(store, level, region, focuses, crs.regions(store, common));
  note_idle_focuses(store, detail, common.context());
  return detail;
}

void SurfaceOptions::report(const Detail& detail, Summary& summary) const {
  std::vector<unsigned> levels;
  for (const FinerRegion& focus : detail.focuses) levels.push_back(focus.level);
  summary.json["level"] = detail.level;
  summary.json["focus_levels"] = levels;
  if (max_error) {
    summary.json["max_error"] = *max_error;
    summary.text += fmt::format("within {} m of every sample\n", plain_number(*max_error));
  }
  if (levels.empty()) return;
  summary.text +=
      fmt::format("level {}, with focuses of level {}\n", detail.level, fmt::join(levels, ", "));
}

}  // namespace terrace::tools
