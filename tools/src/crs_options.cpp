// SPDX-License-Identifier: GPL-3.0-or-later
#include "crs_options.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <CLI/CLI.hpp>

#include "region_crs.hpp"
#include "terrace/stream/error.hpp"
#include "units.hpp"
#include "world.hpp"

namespace terrace::tools {

CoordinateSystem system_of(const stream::Store& store) {
  const std::string file = store.path().string();
  std::optional<CoordinateSystem> system = CoordinateSystem::of(store.schema().crs, file);
  if (!system) {
    throw stream::Error({.file = file,
                         .where = {},
                         .cause = "has no CRS",
                         .remedy = "build it anew with --crs EPSG:n"});
  }
  return *std::move(system);
}

RegionConversion::RegionConversion(const stream::Store& store, const CoordinateSystem& from)
    : systems_({from, system_of(store), world_box(placement_of(store.schema()), store.bounds())}) {}

Region RegionConversion::operator()(Region region) const {
  if (!systems_) return region;
  return region_in(region, systems_->from, systems_->to, systems_->bounds);
}

PlaceConversion::PlaceConversion(const CoordinateSystem& from, const CoordinateSystem& to) {
  if (!from.same_places(to)) systems_.emplace(Systems{from, to});
}

void PlaceConversion::operator()(std::span<stream::Point3> points) const {
  if (!systems_) return;
  std::array<Point2, 1024> places{};
  for (std::size_t first = 0; first < points.size(); first += places.size()) {
    const std::size_t count = std::min(places.size(), points.size() - first);
    for (std::size_t i = 0; i < count; ++i)
      places[i] = {points[first + i][0], points[first + i][1]};
    transform(systems_->from, systems_->to, std::span(places).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      stream::Point3& p = points[first + i];
      if (!std::isfinite(places[i][0]) || !std::isfinite(places[i][1])) {
        throw stream::Error({.file = {},
                             .where = "point " + number_text(p[0]) + " " + number_text(p[1]),
                             .cause = "has no place in " + systems_->to.title(),
                             .remedy = "take another --to-crs or a smaller --region"});
      }
      p[0] = places[i][0];
      p[1] = places[i][1];
    }
  }
}

void CrsOptions::define(CLI::App& app) {
  app.add_option("--region-crs", region_,
                 "the CRS of regions and focuses (EPSG:n or a WKT file; x,y is lon,lat), if it is "
                 "not the store's");
  app.add_option("--to-crs", to_, "the CRS of what is written; heights stay as they are");
  app.add_option("--towgs84", shift_,
                 "dx,dy,dz[,rx,ry,rz,ds] from the datum of those to WGS 84, if it is another");
}

CoordinateSystem CrsOptions::parsed(const std::string& text) const {
  std::optional<DatumShift> shift;
  if (!shift_.empty()) shift = parse_datum_shift(shift_);
  return CoordinateSystem::parse(text, shift);
}

RegionConversion CrsOptions::regions(const stream::Store& store) const {
  if (region_.empty()) return {};
  return RegionConversion(store, parsed(region_));
}

PlaceConversion CrsOptions::places(const stream::Store& store) const {
  const std::optional<CoordinateSystem> target = to();
  if (!target) return {};
  return PlaceConversion(system_of(store), *target);
}

std::optional<CoordinateSystem> CrsOptions::to() const {
  if (to_.empty()) return std::nullopt;
  return parsed(to_);
}

}  // namespace terrace::tools
