// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/store_options.hpp"

#include <utility>

#include <CLI/CLI.hpp>

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
  if (!transformation.note().empty()) common.say(transformation.note());
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

void PartOptions::define(CLI::App& app, const std::string& region_effect) {
  app.add_option("STORE", path, "the store to read")->required();
  app.add_option("--level", level,
                 "points of this level and above, outside the focuses; a number or top")
      ->default_str("0; with --focus top");
  app.add_option("--region", region,
                 region_effect + ": a box, minx,miny[,minz],maxx,maxy[,maxz], or a GeoJSON file");
  app.add_option("--focus", focuses, "BOX:L, all points of level L inside the box; repeatable")
      ->allow_extra_args(false);
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
  app.add_option("--level", level, "only points of this level and above: a number or top")
      ->capture_default_str();
  add_number(
      app, "--max-edge", max_edge,
      "irregular points and coarser levels: triangles with a side longer than this, in metres on "
      "the ground, count as no data, as over water and in shadows (default: no limit)",
      kPositive)
      ->type_name("METRES");
  add_where(app, where);
}

stream::Store SurfaceOptions::open(SamplerOptions& sampler) const {
  sampler.method = parse_interpolation(method);
  sampler.max_edge = max_edge;
  const std::optional<unsigned> requested = parse_level(level);
  stream::Store store = open_store(path, where);
  sampler.level = requested.value_or(store.top());
  return store;
}

}  // namespace terrace::tools
