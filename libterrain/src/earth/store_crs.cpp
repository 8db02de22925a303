// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "base/store_checks.hpp"
#include "base/units.hpp"
#include "earth/crs/definition.hpp"
#include "earth/region_crs.hpp"
#include "earth/source_crs.hpp"
#include "earth/whole_turns.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/latitudes.hpp"

namespace terrace::terrain {

CoordinateSystem system_of(const stream::Store& store, const stream::Message& otherwise) {
  const std::string file = store.path().string();
  check_latitudes(store);
  std::optional<CoordinateSystem> system = CoordinateSystem::of(store.schema().crs, file);
  if (!system) {
    // A CRS recorded by name alone is a local (engineering) system.
    const std::string& name = store.schema().crs.name;
    throw stream::Error(
        file, name.empty() ? "has no CRS"
              : is_geocentric(store.schema().crs)
                  ? fmt::format("has the geocentric CRS \"{}\", which is not converted", name)
                  : fmt::format("has the CRS \"{}\", which has no place on the earth", name))
        .remedy(stream::message("rebuild it with {crs} EPSG:n{}", otherwise));
  }
  return system->over(world_box(store.schema(), store.bounds()));
}

Transformation transformation_to(const stream::Store& store, const std::string& named,
                                 const std::optional<DatumShift>& shift) {
  CoordinateSystem store_system = system_of(store);
  const CoordinateSystem other = CoordinateSystem::parse(named, shift);
  if (shift && !other.definition().shift && !store_system.counts_as_wgs84()) {
    CrsDefinition shifted = store_system.definition();
    shifted.shift = shift;
    store_system = CoordinateSystem(shifted);
  }
  return {store_system, other};
}

namespace {

/// The shift belongs to the system whose datum is not WGS 84's.
CoordinateSystem shifted(const CoordinateSystem& system, const std::optional<DatumShift>& shift) {
  if (!shift || system.counts_as_wgs84()) return system;
  CrsDefinition definition = system.definition();
  definition.shift = shift;
  return CoordinateSystem(definition);
}

/// Returns the CRS that GeoJSON names. The name never leads to a file: the author of a GeoJSON file
/// must not choose which other files are read.
CoordinateSystem system_named_in(const PlacesCrs& places_crs) {
  std::string name = places_crs.name;
  // http://www.opengis.net/def/crs/EPSG/0/4326
  constexpr std::string_view kUrl = "opengis.net/def/crs/";
  if (const std::size_t at = name.find(kUrl); at != name.npos) {
    const std::string_view rest = std::string_view(name).substr(at + kUrl.size());
    name = std::string(rest.substr(0, rest.find('/'))) + ':' +
           std::string(rest.substr(rest.rfind('/') + 1));
  }
  if (name.ends_with("CRS84")) name = "OGC:CRS84";
  try {
    const bool code = name.find(':') != name.npos && name.find('/') == name.npos;
    if (code || name.find('[') != name.npos) return CoordinateSystem::parse(name);
  } catch (const UsageError&) {
    // Reported below, with the file.
  }
  throw stream::Error(places_crs.file,
                      fmt::format("its crs \"{}\" is not known", places_crs.name.substr(0, 80)))
      .remedy(stream::message("write a known one, like EPSG:n, or give {region_crs}"));
}

}  // namespace

RegionConversion::RegionConversion(const stream::Store& store,
                                   const std::optional<DatumShift>& shift)
    : system_([store, shift]() -> std::optional<CoordinateSystem> {
        try {
          return shifted(system_of(store), shift);
        } catch (const stream::Error&) {
          return std::nullopt;  // none, or an unknown one
        }
      }),
      bounds_(world_box(store.schema(), store.whole().bounds())),
      tolerance_(border_tolerance(store.schema())),
      turn_(WholeTurns(store.schema(), store.whole().bounds()).turn()) {}

RegionConversion::RegionConversion(const stream::Store& store, Transformation to_regions)
    : RegionConversion(store) {
  overrides_ = true;
  if (!to_regions.identity()) to_regions_ = std::move(to_regions);
}

RegionConversion::RegionConversion(const stream::SourceInfo& source, const std::string& named,
                                   const std::optional<DatumShift>& shift)
    : tolerance_(border_tolerance(source)) {
  std::optional<CoordinateSystem> system;
  try {
    system = crs_of_source(source, shift).system;
  } catch (const CrsDatabaseError&) {
    throw;
  } catch (const stream::Error&) {
    if (!named.empty()) throw;
  }
  if (!system && !named.empty()) {
    throw stream::Error(source.files.empty() ? std::string() : source.files.front(),
                        "has no known CRS, so the region cannot be converted to it")
        .remedy(stream::message("leave {region_crs} out and pass the region in its coordinates"));
  }
  const bool degrees = source.crs.geographic && source.crs.horizontal_unit == "degree";
  turn_ = system ? system->turn() : degrees ? 360 : 0;
  stream::Box3 area;
  std::optional<stream::Box3> stored = source.stated_bounds;
  if (source.grid) {
    const auto end = [](std::uint64_t n) { return static_cast<double>(n); };
    stored = {{0, 0, 0}, {end(source.columns), end(source.rows), 0}};
  }
  if (stored) area = world_box(source, *stored);
  bounds_ = area;
  if (source.grid) {
    // A wider area is not on the earth.
    if (!(area.max[0] - area.min[0] <= turn_)) turn_ = 0;
  } else {
    // Longitudes from -180 to 180, or from 0 to 360, in addition to the bounds that a header
    // states: if those are wrong, the points are elsewhere.
    bounds_.include(stream::Box3{{-0.5 * turn_, -0.5 * turn_, 0}, {turn_, 0.5 * turn_, 0}});
  }
  if (system && stored) system = system->over(area);
  system_ = [system] { return system; };
  if (named.empty()) return;
  overrides_ = true;
  Transformation change(*system, CoordinateSystem::parse(named));
  if (!change.identity()) to_regions_ = std::move(change);
}

bool RegionConversion::may_turn(const Region& region) {
  if (region.crs()) return true;
  constexpr double kFourTurns = 1600, kPole = 100;  // in gradians, the smallest unit
  const stream::Box3& box = region.box();
  return box.min[0] <= kFourTurns && box.max[0] >= -kFourTurns && box.min[1] <= kPole &&
         box.max[1] >= -kPole;
}

std::optional<Transformation> RegionConversion::to_places(const PlacesCrs& places_crs,
                                                          const stream::Box3& box) const {
  const std::optional<CoordinateSystem> store_system = system_ ? system_() : std::nullopt;
  if (!store_system && places_crs.name.empty()) return std::nullopt;
  if (!store_system) {
    throw stream::Error(places_crs.file,
                        fmt::format("its crs is {}, and the CRS of the data is not known",
                                    system_named_in(places_crs).title()))
        .remedy(stream::message("pass the CRS of the data as {crs} EPSG:n when they are read or "
                                "built, or leave the crs out if it is the same"));
  }
  if (places_crs.name.empty()) {
    // Longitudes may be counted to 360, and continue beyond the antimeridian.
    const bool fits =
        box.min[0] >= -360 && box.max[0] <= 540 && box.min[1] >= -90 && box.max[1] <= 90;
    if (!fits || !store_system->reaches_wgs84()) {
      // In a system of longitudes and latitudes the note would contradict itself.
      if (!fits && store_system->is_geographic()) return std::nullopt;
      say(places_crs.file + ": has no crs, and its places are read in the CRS of the data, " +
          store_system->title() + (fits ? "" : ", because they are not longitudes and latitudes"));
      return std::nullopt;
    }
  }
  Transformation change(*store_system,
                        places_crs.name.empty() ? CoordinateSystem() : system_named_in(places_crs));
  if (change.identity()) return std::nullopt;
  say(change.note());
  return change;
}

namespace {

/// Throws: stream::Error for a region beyond a pole. file: the GeoJSON file, if any.
void check_region(const Region& region, double max_latitude, const std::string& file) {
  // Half of the outermost cells of a global raster may be beyond a pole.
  constexpr double kHalfCell = 1;
  const stream::Box3& box = region.box();
  const std::array<Point2, 2> corners{{{box.min[0], box.min[1]}, {box.max[0], box.max[1]}}};
  check_latitudes(corners, max_latitude, file, "the region", kHalfCell);
}

}  // namespace

Region RegionConversion::operator()(Region region) const {
  const std::optional<PlacesCrs> places_crs = region.crs();
  region = region.in_crs({});
  if (to_regions_) {
    check_region(region, to_regions_->to().most_latitude(),
                 places_crs ? places_crs->file : std::string());
    return region_in(region, *to_regions_, bounds_);
  }
  // Only longitudes, in degrees or gradians, have a turn this short.
  constexpr double kLongestTurn = 400;
  const bool turns = turn_ > 0 && turn_ <= kLongestTurn;
  const double max_latitude = turns ? turn_ / 4 : std::numeric_limits<double>::infinity();
  if (places_crs && !overrides_) {
    if (const auto change = to_places(*places_crs, region.box())) {
      check_region(region, change->to().most_latitude(), places_crs->file);
      return region_in(region, *change, bounds_);
    }
  }
  check_region(region, max_latitude, places_crs ? places_crs->file : std::string());
  return with_turns(region, turn_, bounds_, tolerance_);
}

PlaceConversion::PlaceConversion(Transformation change) {
  if (!change.identity()) change_.emplace(std::move(change));
}

PlaceConversion::PlaceConversion(Transformation change, const stream::Store& store)
    : PlaceConversion(std::move(change)) {
  if (!change_) return;
  turn_ = change_->to().turn();
  middle_ = middle_in(*change_, world_box(store.schema(), store.whole().bounds()))[0];
}

void PlaceConversion::operator()(std::span<Point2> places) const {
  if (!change_) return;
  change_->forward(places);
  if (!(turn_ > 0)) return;
  const WholeTurns turns(middle_, turn_);
  for (Point2& place : places) place = turns(place);
}

void PlaceConversion::operator()(std::span<stream::Point3> points,
                                 const base::StopCheck& check_stop) const {
  if (!change_) return;
  std::array<Point2, 1024> places{};
  for (std::size_t first = 0; first < points.size(); first += places.size()) {
    if (check_stop) check_stop();
    const std::size_t count = std::min(places.size(), points.size() - first);
    for (std::size_t i = 0; i < count; ++i)
      places[i] = {points[first + i][0], points[first + i][1]};
    (*this)(std::span(places).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      stream::Point3& p = points[first + i];
      if (!std::isfinite(places[i][0]) || !std::isfinite(places[i][1])) {
        throw stream::Error("", "has no image in " + change_->to().title())
            .at(fmt::format("point {} {}", plain_number(p[0]), plain_number(p[1])))
            .remedy(stream::message("choose another {to_crs} or a smaller {region}"));
      }
      p[0] = places[i][0];
      p[1] = places[i][1];
    }
  }
}

stream::Box3 PlaceConversion::box_around(const stream::Box3& box) const {
  if (!change_ || box.empty()) return box;
  constexpr int kSteps = 32;
  std::vector<Point2> places;
  for (int i = 0; i <= kSteps * (kSteps + 2); ++i) {
    const std::array<int, 2> step{i % (kSteps + 1), i / (kSteps + 1)};
    Point2 place{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double part = static_cast<double>(step[axis]) / kSteps;
      place[axis] = box.min[axis] * (1 - part) + box.max[axis] * part;
    }
    places.push_back(place);
  }
  (*this)(std::span<Point2>(places));
  stream::Box3 around;
  for (const Point2& place : places) {
    if (!std::isfinite(place[0]) || !std::isfinite(place[1])) continue;
    around.include(stream::Point3{place[0], place[1], box.min[2]});
    around.include(stream::Point3{place[0], place[1], box.max[2]});
  }
  if (around.empty()) return around;
  // The images between the sampled places bend by less than this.
  constexpr double kBend = 0.02;
  const double margin =
      kBend * std::max(around.max[0] - around.min[0], around.max[1] - around.min[1]);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    around.min[axis] -= margin;
    around.max[axis] += margin;
  }
  return around;
}

std::optional<stream::Crs> PlaceConversion::crs() const {
  return change_ ? std::optional(change_->to().crs()) : std::nullopt;
}

}  // namespace terrace::terrain
