// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/crs_options.hpp"

#include <utility>

#include <CLI/CLI.hpp>

#include "cli/cli.hpp"

namespace terrace::tools {

Transformation CrsOptions::change(const stream::Store& store, const std::string& named,
                                  const CommonOptions& common) const {
  Transformation change = transformation_to(store, named, parse_datum_shift(shift_));
  if (!change.note().empty()) common.say(change.note());
  return change;
}

RegionConversion CrsOptions::regions(const stream::Store& store,
                                     const CommonOptions& common) const {
  if (region_.empty()) return {};
  return RegionConversion(store, change(store, region_, common));
}

PlaceConversion CrsOptions::places(const stream::Store& store, const CommonOptions& common) const {
  if (to_.empty()) return {};
  return PlaceConversion(change(store, to_, common));
}

std::optional<Transformation> CrsOptions::to(const stream::Store& store,
                                             const CommonOptions& common) const {
  if (to_.empty()) return std::nullopt;
  Transformation to = change(store, to_, common);
  if (to.identity()) return std::nullopt;
  return to;
}

void CrsOptions::define(CLI::App& app) {
  define_region(app);
  app.add_option("--to-crs", to_, "the CRS of what is written; heights stay as they are");
}

void CrsOptions::define_region(CLI::App& app) {
  app.add_option("--region-crs", region_,
                 "the CRS of regions and focuses (EPSG:n or a WKT file; x,y is lon,lat), if it is "
                 "not the store's");
  app.add_option("--towgs84", shift_,
                 "dx,dy,dz[,rx,ry,rz,ds] to WGS 84 from the datum of such a CRS, or of the store, "
                 "if it is another");
}

}  // namespace terrace::tools
