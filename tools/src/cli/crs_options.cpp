// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/crs_options.hpp"

#include <CLI/CLI.hpp>

namespace terrace::tools {

RegionConversion CrsOptions::regions(const stream::Store& store) const {
  if (region_.empty()) return {};
  return RegionConversion(store, systems_of(store, region_, shift_));
}

PlaceConversion CrsOptions::places(const stream::Store& store) const {
  if (to_.empty()) return {};
  const SystemPair pair = systems_of(store, to_, shift_);
  return PlaceConversion(pair.store, pair.named);
}

std::optional<SystemPair> CrsOptions::to(const stream::Store& store) const {
  if (!places(store).has_effect()) return std::nullopt;
  return systems_of(store, to_, shift_);
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
