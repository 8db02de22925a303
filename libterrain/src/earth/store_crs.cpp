// SPDX-License-Identifier: GPL-3.0-or-later
#include "earth/store_crs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/units.hpp"
#include "earth/region_crs.hpp"
#include "earth/world.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::terrain {

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

SystemPair systems_of(const stream::Store& store, const std::string& named,
                      const std::string& shift) {
  std::optional<DatumShift> values;
  if (!shift.empty()) values = parse_datum_shift(shift);
  SystemPair pair{system_of(store), CoordinateSystem::parse(named, values)};
  const bool used = pair.named.definition().uncertainty < 0;
  if (values && !used && !pair.store.reaches_wgs84()) {
    CrsDefinition shifted = pair.store.definition();
    shifted.shift = values;
    pair.store = CoordinateSystem(shifted);
  }
  return pair;
}

RegionConversion::RegionConversion(const stream::Store& store, const SystemPair& systems)
    : systems_({systems.named, systems.store,
                world_box(placement_of(store.schema()), store.bounds())}) {}

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

}  // namespace terrace::terrain
