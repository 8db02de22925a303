// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>
#include <variant>
#include <vector>

#include <GeographicLib/Math.hpp>
#include <fmt/core.h>
#include <terrace/base/portable_math.hpp>

#include "base/units.hpp"
#include "earth/crs/datum_change.hpp"
#include "earth/crs/definition.hpp"
#include "earth/crs/geo_keys.hpp"
#include "earth/crs/projection_engine.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/latitudes.hpp"

namespace terrace::terrain {

namespace {

std::string angle_name(double degrees) {
  if (degrees == 1) return "degree";
  if (std::abs(degrees / 0.9 - 1) < 1e-12) return "grad";
  if (std::abs(degrees * base::kRadiansPerDegree - 1) < 1e-12) return "radian";
  if (std::abs(degrees * 3600 - 1) < 1e-12) return "arc-second";
  return {};
}

const CrsDefinition& wgs84() {
  static const CrsDefinition definition = definition_of_epsg(4326);
  return definition;
}

/// Throws: stream::Error if PROJ cannot compute an operation from its database.
DatumChange change_between(const CrsDefinition& from, const CrsDefinition& to,
                           const std::optional<GeographicArea>& area) {
  try {
    return {from, to, area};
  } catch (const CrsError& error) {
    throw stream::Error("", error.what()).at(from.title()).remedy(error.remedy());
  }
}

[[noreturn]] void fail_without_way(const CoordinateSystem& from, const std::string& to,
                                   const DatumChange& change) {
  throw stream::Error(
      "", fmt::format("the CRS {} has the datum {}, and no operation leads from it to {}{}",
                      from.title(), from.definition().datum, to,
                      change.better().empty() ? "" : ": " + change.better()))
      .remedy(
          stream::message("{}give {shift} dx,dy,dz[,rx,ry,rz,ds] here or when the store is built, "
                          "or convert the data to a system on WGS 84, ETRS89 or NAD83 first",
                          change.better().empty() ? "" : "install that grid, or "));
}

}  // namespace

struct CoordinateSystem::Data {
  CrsDefinition definition;
  std::shared_ptr<const Projection> projection;  ///< null if geographic
};

struct CoordinateSystem::LazyChange {
  std::once_flag once;
  std::optional<DatumChange> change;
};

CoordinateSystem::CoordinateSystem() : CoordinateSystem(wgs84()) {}

CoordinateSystem::CoordinateSystem(const CrsDefinition& definition)
    : data_(std::make_shared<const Data>(
          Data{definition, definition.geographic ? nullptr : projection_of(definition)})),
      wgs84_(std::make_shared<LazyChange>()) {}

const CrsDefinition& CoordinateSystem::definition() const { return data_->definition; }
bool CoordinateSystem::is_geographic() const { return definition().geographic; }
std::string CoordinateSystem::title() const { return definition().title(); }
Heights CoordinateSystem::heights() const { return definition().heights; }
bool CoordinateSystem::reaches_wgs84() const { return to_wgs84().possible(); }
bool CoordinateSystem::counts_as_wgs84() const {
  return to_wgs84().possible() && to_wgs84().identity();
}

namespace {

/// Calls a function of CRSs that the user wrote as `text`. Throws: UsageError.
template <class Function>
auto of_text(const std::string& text, const Function& function) {
  try {
    return function(crs_of_text(text));
  } catch (const CrsError& error) {
    throw UsageError(
        stream::message("'{}': {}; {}", text.substr(0, 80), error.what(), error.remedy()));
  }
}

}  // namespace

stream::Crs crs_named(const std::string& text) {
  return of_text(text, [](AnyCrs system) {
    if (const auto* const local = std::get_if<LocalCrs>(&system)) return local->crs;
    CrsDefinition definition = on_earth(std::move(system));
    // A vertical CRS of heights above the ellipsoid is not kept as WKT, but the record needs it.
    if (definition.heights == Heights::ellipsoidal && definition.height_wkt.empty() &&
        definition.vertical_epsg == 0) {
      write_height_unit(definition, definition.metres_per_height);
    }
    return CoordinateSystem(definition).crs();
  });
}

CoordinateSystem CoordinateSystem::parse(const std::string& text,
                                         const std::optional<DatumShift>& shift) {
  return of_text(text, [&shift](AnyCrs read) {
    CrsDefinition definition = on_earth(std::move(read));
    CoordinateSystem system(definition);
    if (!shift || system.counts_as_wgs84()) return system;
    definition.shift = shift;
    return CoordinateSystem(definition);
  });
}

std::optional<CoordinateSystem> CoordinateSystem::of(const stream::Crs& crs,
                                                     const std::string& file) {
  try {
    const std::optional<CrsDefinition> definition = definition_of(crs);
    if (!definition) return std::nullopt;
    return CoordinateSystem(*definition);
  } catch (const CrsError& error) {
    throw stream::Error(file, error.what()).remedy(error.remedy());
  }
}

CoordinateSystem CoordinateSystem::over(const stream::Box3& box) const {
  CoordinateSystem copy = *this;
  copy.area_.reset();
  copy.wgs84_ = std::make_shared<LazyChange>();
  if (box.empty()) return copy;
  constexpr int kSteps = 8;
  std::vector<Point2> places;
  for (int j = 0; j <= kSteps; ++j) {
    for (int i = 0; i <= kSteps; ++i) {
      const double s = static_cast<double>(i) / kSteps, t = static_cast<double>(j) / kSteps;
      places.push_back(
          {box.min[0] + s * (box.max[0] - box.min[0]), box.min[1] + t * (box.max[1] - box.min[1])});
    }
  }
  to_own_geographic(places);
  std::erase_if(places,
                [](const Point2& p) { return !std::isfinite(p[0]) || !(std::abs(p[1]) <= 90); });
  if (places.empty()) return copy;
  GeographicArea area{places[0][0], places[0][1], places[0][0], places[0][1]};
  for (const Point2& p : places) {
    const double longitude = p[0] + 360 * std::round((places[0][0] - p[0]) / 360);
    area.west = std::min(area.west, longitude);
    area.east = std::max(area.east, longitude);
    area.south = std::min(area.south, p[1]);
    area.north = std::max(area.north, p[1]);
  }
  if (area.east - area.west >= 180) {
    area.west = -180;
    area.east = 180;
  } else {
    area.west = GeographicLib::Math::AngNormalize(area.west);
    area.east = GeographicLib::Math::AngNormalize(area.east);
  }
  copy.area_ = area;
  return copy;
}

double CoordinateSystem::metres_per_unit() const {
  return is_geographic() ? 0.0 : definition().metres_per_unit;
}

double CoordinateSystem::most_latitude() const {
  return is_geographic() ? 90 / definition().degrees_per_unit
                         : std::numeric_limits<double>::infinity();
}

double CoordinateSystem::turn() const {
  const CrsDefinition& system = definition();
  if (is_geographic()) return 360 / system.degrees_per_unit;
  const bool cylinder = system.method == ProjectionMethod::web_mercator ||
                        system.method == ProjectionMethod::mercator_a ||
                        system.method == ProjectionMethod::mercator_b;
  if (!cylinder) return 0;
  const double middle = system.prime_meridian + system.parameters.longitude;
  std::array<Point2, 2> half{{{middle - 90, 0}, {middle + 90, 0}}};
  from_own_geographic(half);
  return 2 * (half[1][0] - half[0][0]);
}

std::optional<double> CoordinateSystem::metres_per_height() const {
  if (definition().metres_per_height == 0) return std::nullopt;
  return definition().metres_per_height;
}

stream::Crs CoordinateSystem::crs() const {
  const CrsDefinition& system = definition();
  stream::Crs crs;
  crs.epsg = system.epsg();
  crs.vertical_epsg = system.vertical_epsg;
  crs.name = system.name;
  crs.wkt = wkt_of(system);
  crs.geographic = is_geographic();
  crs.horizontal_unit =
      is_geographic() ? angle_name(system.degrees_per_unit) : unit_name(system.metres_per_unit);
  if (system.metres_per_height != 0) crs.vertical_unit = recorded_unit(system.metres_per_height);
  return crs;
}

stream::Crs CoordinateSystem::crs_with_keys() const {
  stream::Crs record = crs();
  if (record.epsg == 0) record.geo_keys = geo_keys_of(definition());
  return record;
}

stream::Crs CoordinateSystem::crs_with_wkt1() const {
  stream::Crs record = crs();
  const std::string old = wkt1_of(definition());
  if (!old.empty()) record.wkt = old;
  return record;
}

const DatumChange& CoordinateSystem::to_wgs84() const {
  std::call_once(wgs84_->once,
                 [this] { wgs84_->change = change_between(definition(), wgs84(), area_); });
  return *wgs84_->change;
}

std::string CoordinateSystem::wgs84_note() const {
  if (!reaches_wgs84() || counts_as_wgs84()) return {};
  return title() + " to WGS 84 by " + to_wgs84().description();
}

void CoordinateSystem::to_own_geographic(std::span<Point2> places) const {
  const CrsDefinition& system = definition();
  if (is_geographic()) {
    const double unit = system.degrees_per_unit, meridian = system.prime_meridian;
    for (Point2& place : places) {
      place = {place[0] * unit + meridian, latitude_on_earth(place[1] * unit)};
    }
    return;
  }
  const double unit = system.metres_per_unit;
  if (unit != 1) {
    for (Point2& place : places) place = {place[0] * unit, place[1] * unit};
  }
  data_->projection->reverse(places);
  if (system.prime_meridian != 0) {
    for (Point2& place : places) {
      place[0] = GeographicLib::Math::AngNormalize(place[0] + system.prime_meridian);
    }
  }
}

void CoordinateSystem::from_own_geographic(std::span<Point2> places) const {
  const CrsDefinition& system = definition();
  const double meridian = system.prime_meridian;
  if (is_geographic()) {
    const double unit = system.degrees_per_unit;
    if (unit == 1 && meridian == 0) return;
    for (Point2& place : places) place = {(place[0] - meridian) / unit, place[1] / unit};
    return;
  }
  if (meridian != 0) {
    for (Point2& place : places) place[0] -= meridian;
  }
  data_->projection->forward(places);
  const double unit = system.metres_per_unit;
  if (unit != 1) {
    for (Point2& place : places) place = {place[0] / unit, place[1] / unit};
  }
}

void CoordinateSystem::to_geographic(std::span<Point2> places) const {
  const DatumChange& change = to_wgs84();
  if (!change.possible()) fail_without_way(*this, "WGS 84", change);
  to_own_geographic(places);
  if (!change.identity()) change.forward(places);
}

void CoordinateSystem::from_geographic(std::span<Point2> places) const {
  const DatumChange& change = to_wgs84();
  if (!change.possible()) fail_without_way(*this, "WGS 84", change);
  if (!change.identity()) change.reverse(places);
  from_own_geographic(places);
}

Point2 CoordinateSystem::to_geographic(Point2 place) const {
  to_geographic(std::span(&place, 1));
  return place;
}

Point2 CoordinateSystem::from_geographic(Point2 place) const {
  from_geographic(std::span(&place, 1));
  return place;
}

bool CoordinateSystem::same_places(const CoordinateSystem& other) const {
  return data_ == other.data_ || terrain::same_places(definition(), other.definition());
}

namespace {

/// Removes a shift of zeros if the datum counts as WGS 84 anyway, because writers add
/// TOWGS84[0,0,0,...].
CrsDefinition without_idle_shift(CrsDefinition definition) {
  if (!definition.shift || *definition.shift != DatumShift{}) return definition;
  CrsDefinition bare = definition;
  bare.shift.reset();
  return CoordinateSystem(bare).counts_as_wgs84() ? bare : definition;
}

bool same_heights(const CrsDefinition& a, const CrsDefinition& b) {
  if (a.heights != b.heights || a.vertical_epsg != b.vertical_epsg) return false;
  if (!(std::abs(a.metres_per_height - b.metres_per_height) <= 1e-9 * a.metres_per_height)) {
    return false;
  }
  if (a.heights != Heights::orthometric || a.vertical_epsg != 0) return true;
  return a.vertical_name == b.vertical_name;
}

}  // namespace

bool same_crs(const stream::Crs& a, const stream::Crs& b) {
  if (a == b) return true;
  try {
    const std::optional<CrsDefinition> one = definition_of(a), other = definition_of(b);
    if (!one || !other) return false;
    return terrain::same_places(without_idle_shift(*one), without_idle_shift(*other)) &&
           same_heights(*one, *other);
  } catch (const CrsError&) {
    return false;
  }
}

Transformation::Transformation(CoordinateSystem from, CoordinateSystem to)
    : from_(std::move(from)),
      to_(std::move(to)),
      same_(from_.same_places(to_)),
      change_(std::make_shared<const DatumChange>(
          change_between(from_.definition(), same_ ? from_.definition() : to_.definition(),
                         from_.area() ? from_.area() : to_.area()))) {
  if (!change_->possible()) {
    // Direct the remedy at the system whose datum differs from WGS 84.
    const bool other = from_.counts_as_wgs84() && !to_.counts_as_wgs84();
    fail_without_way(other ? to_ : from_, (other ? from_ : to_).definition().datum, *change_);
  }
}

void Transformation::forward(std::span<Point2> places) const {
  if (same_) return;
  from_.to_own_geographic(places);
  change_->forward(places);
  to_.from_own_geographic(places);
}

void Transformation::reverse(std::span<Point2> places) const {
  if (same_) return;
  to_.to_own_geographic(places);
  change_->reverse(places);
  from_.from_own_geographic(places);
}

std::string Transformation::note() const {
  if (same_ || change_->identity()) return {};
  return from_.title() + " to " + to_.title() + " by " + change_->description();
}

std::optional<DatumShift> parse_datum_shift(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const std::vector<double> numbers = parse_numbers(text, stream::message("{shift}"));
  if (numbers.size() != 3 && numbers.size() != 7) {
    throw UsageError(stream::message(
        "{shift} takes three or seven numbers, dx,dy,dz[,rx,ry,rz,ds], not {}", numbers.size()));
  }
  DatumShift shift{};
  std::copy(numbers.begin(), numbers.end(), shift.begin());
  return shift;
}

}  // namespace terrace::terrain
