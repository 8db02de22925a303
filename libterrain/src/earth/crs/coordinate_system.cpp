// SPDX-License-Identifier: GPL-3.0-or-later
#include "earth/crs/coordinate_system.hpp"

#include <algorithm>
#include <cmath>

#include <GeographicLib/Geocentric.hpp>

#include "base/portable_math.hpp"
#include "earth/crs/projection_batch.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::terrain {
namespace {

using Matrix = std::array<double, 9>;
using Vector = std::array<double, 3>;

Vector product(const Matrix& m, const Vector& v) {
  return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
          m[6] * v[0] + m[7] * v[1] + m[8] * v[2]};
}

Matrix inverse(const Matrix& m) {
  const auto minor = [&m](std::size_t a, std::size_t b, std::size_t c, std::size_t d) {
    return m[a] * m[d] - m[b] * m[c];
  };
  const Matrix adjoint{minor(4, 5, 7, 8), minor(2, 1, 8, 7), minor(1, 2, 4, 5),
                       minor(5, 3, 8, 6), minor(0, 2, 6, 8), minor(2, 0, 5, 3),
                       minor(3, 4, 6, 7), minor(1, 0, 7, 6), minor(0, 1, 3, 4)};
  const double determinant = m[0] * adjoint[0] + m[1] * adjoint[3] + m[2] * adjoint[6];
  Matrix result{};
  for (std::size_t i = 0; i < 9; ++i) result[i] = adjoint[i] / determinant;
  return result;
}

GeographicLib::Geocentric geocentric_of(const Ellipsoid& ellipsoid) {
  return {ellipsoid.semi_major, ellipsoid.flattening()};
}

std::string unit_name(double metres) {
  if (metres == 1) return "metre";
  if (metres == 0.3048) return "foot";
  if (std::abs(metres / (1200.0 / 3937.0) - 1) < 1e-9) return "US survey foot";
  if (metres == 1000) return "kilometre";
  return {};
}

std::string angle_name(double degrees) {
  if (degrees == 1) return "degree";
  if (std::abs(degrees / 0.9 - 1) < 1e-12) return "grad";
  if (std::abs(degrees * kDegree - 1) < 1e-12) return "radian";
  if (std::abs(degrees * 3600 - 1) < 1e-12) return "arc-second";
  return {};
}

/// What is impossible whichever way it was described. Throws: CrsError.
void check_numbers(const CrsDefinition& definition, const std::string& title) {
  const auto fail = [&title](const char* what) {
    throw CrsError("the CRS " + title + " has " + what, "give another with --crs EPSG:n");
  };
  const auto is_size = [](double value) { return value > 0 && std::isfinite(value); };
  const Ellipsoid& ellipsoid = definition.ellipsoid;
  if (!is_size(ellipsoid.semi_major) ||
      !(ellipsoid.flattening() >= 0 && ellipsoid.flattening() < 0.5)) {
    fail("an impossible ellipsoid");
  }
  if (!is_size(definition.degrees_per_unit) || !is_size(definition.metres_per_unit) ||
      !(definition.metres_per_height == 0 || is_size(definition.metres_per_height))) {
    fail("a unit without a size");
  }
  if (!std::isfinite(definition.prime_meridian)) fail("no prime meridian");
  if (!definition.shift) return;
  for (const double value : *definition.shift) {
    if (!std::isfinite(value)) fail("a shift to WGS 84 that is not finite");
  }
}

}  // namespace

/// From a datum's geocentric coordinates to those of WGS 84 and back, for places on the ellipsoid.
struct CoordinateSystem::Shift {
  Shift(const Ellipsoid& ellipsoid, const DatumShift& s)
      : own(geocentric_of(ellipsoid)), wgs84(GeographicLib::Geocentric::WGS84()) {
    constexpr double kArcSecond = kDegree / 3600;
    const double m = 1 + s[6] * 1e-6;
    const double rx = s[3] * kArcSecond * m, ry = s[4] * kArcSecond * m, rz = s[5] * kArcSecond * m;
    turn = {m, -rz, ry, rz, m, -rx, -ry, rx, m};
    back = inverse(turn);
    move = {s[0], s[1], s[2]};
  }

  [[nodiscard]] Point2 forward(const Point2& place) const {
    Vector v{};
    own.Forward(place[1], place[0], 0, v[0], v[1], v[2]);
    v = product(turn, v);
    for (std::size_t i = 0; i < 3; ++i) v[i] += move[i];
    double latitude = 0, longitude = 0, height = 0;
    wgs84.Reverse(v[0], v[1], v[2], latitude, longitude, height);
    return {longitude, latitude};
  }
  [[nodiscard]] Point2 reverse(const Point2& place) const {
    Vector v{};
    wgs84.Forward(place[1], place[0], 0, v[0], v[1], v[2]);
    for (std::size_t i = 0; i < 3; ++i) v[i] -= move[i];
    v = product(back, v);
    double latitude = 0, longitude = 0, height = 0;
    own.Reverse(v[0], v[1], v[2], latitude, longitude, height);
    return {longitude, latitude};
  }

  GeographicLib::Geocentric own, wgs84;
  Matrix turn{}, back{};
  Vector move{};
};

CoordinateSystem::CoordinateSystem() : CoordinateSystem(definition_of_epsg(4326)) {}

CoordinateSystem::CoordinateSystem(const CrsDefinition& definition) : definition_(definition) {
  check_numbers(definition_, title());
  if (definition_.method) {
    try {
      projection_ =
          make_projection(*definition_.method, definition_.parameters, definition_.ellipsoid);
    } catch (const std::invalid_argument& error) {
      throw CrsError("the CRS " + title() + " has no usable projection: " + error.what(),
                     "give another with --crs EPSG:n");
    }
  }
  if (definition_.shift) {
    shift_ = std::make_shared<const Shift>(definition_.ellipsoid, *definition_.shift);
  }
}

std::string CoordinateSystem::title() const {
  const std::string& name = definition_.name;
  if (definition_.epsg == 0) return name.empty() ? "without a name" : '"' + name + '"';
  return "EPSG:" + std::to_string(definition_.epsg) + (name.empty() ? "" : " (" + name + ")");
}

double CoordinateSystem::metres_per_unit() const {
  return is_geographic() ? 0.0 : definition_.metres_per_unit;
}

std::optional<double> CoordinateSystem::metres_per_height() const {
  if (definition_.metres_per_height == 0) return std::nullopt;
  return definition_.metres_per_height;
}

stream::Crs CoordinateSystem::crs() const {
  stream::Crs crs;
  crs.epsg = definition_.epsg;
  crs.vertical_epsg = definition_.vertical_epsg;
  crs.name = definition_.name;
  crs.wkt = wkt_of(definition_);
  crs.geographic = is_geographic();
  crs.horizontal_unit = is_geographic() ? angle_name(definition_.degrees_per_unit)
                                        : unit_name(definition_.metres_per_unit);
  if (definition_.metres_per_height != 0) {
    crs.vertical_unit = unit_name(definition_.metres_per_height);
  }
  return crs;
}

bool CoordinateSystem::reaches_wgs84() const {
  return shift_ != nullptr || definition_.uncertainty >= 0;
}

double CoordinateSystem::uncertainty() const {
  return shift_ != nullptr ? 0.0 : std::max(0.0, definition_.uncertainty);
}

void CoordinateSystem::require_wgs84() const {
  if (reaches_wgs84()) return;
  throw stream::Error(
      {.file = {},
       .where = {},
       .cause = "the CRS " + title() + " has the datum " + definition_.datum +
                ", which is not WGS 84, and no shift to it",
       .remedy = "give --towgs84 dx,dy,dz[,rx,ry,rz,ds], or convert the data to a system on "
                 "WGS 84, ETRS89 or NAD83 first"});
}

void CoordinateSystem::to_own_geographic(std::span<Point2> places) const {
  if (!projection_) {
    const double unit = definition_.degrees_per_unit, meridian = definition_.prime_meridian;
    if (unit == 1 && meridian == 0) return;
    for (Point2& place : places) place = {place[0] * unit + meridian, place[1] * unit};
    return;
  }
  const double unit = definition_.metres_per_unit;
  if (unit != 1) {
    for (Point2& place : places) place = {place[0] * unit, place[1] * unit};
  }
  projection_->reverse(places);
  if (definition_.prime_meridian != 0) {
    for (Point2& place : places) {
      place[0] = GeographicLib::Math::AngNormalize(place[0] + definition_.prime_meridian);
    }
  }
}

void CoordinateSystem::from_own_geographic(std::span<Point2> places) const {
  const double meridian = definition_.prime_meridian;
  if (!projection_) {
    const double unit = definition_.degrees_per_unit;
    if (unit == 1 && meridian == 0) return;
    for (Point2& place : places) place = {(place[0] - meridian) / unit, place[1] / unit};
    return;
  }
  if (meridian != 0) {
    for (Point2& place : places) place[0] -= meridian;
  }
  projection_->forward(places);
  const double unit = definition_.metres_per_unit;
  if (unit != 1) {
    for (Point2& place : places) place = {place[0] / unit, place[1] / unit};
  }
}

void CoordinateSystem::to_geographic(std::span<Point2> places) const {
  require_wgs84();
  to_own_geographic(places);
  if (shift_) {
    for (Point2& place : places) place = shift_->forward(place);
  }
}

void CoordinateSystem::from_geographic(std::span<Point2> places) const {
  require_wgs84();
  if (shift_) {
    for (Point2& place : places) place = shift_->reverse(place);
  }
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
  const CrsDefinition &a = definition_, &b = other.definition_;
  const bool datum = a.ellipsoid == b.ellipsoid && a.prime_meridian == b.prime_meridian &&
                     a.shift == b.shift && (a.uncertainty >= 0) == (b.uncertainty >= 0) &&
                     (a.uncertainty >= 0 || a.datum == b.datum);
  if (!datum || a.method != b.method) return false;
  if (!a.method) return a.degrees_per_unit == b.degrees_per_unit;
  return nearly_equal(a.parameters, b.parameters) && a.metres_per_unit == b.metres_per_unit;
}

void transform(const CoordinateSystem& from, const CoordinateSystem& to, std::span<Point2> places) {
  if (from.same_places(to)) return;
  const CrsDefinition &a = from.definition(), &b = to.definition();
  // Datums that count as WGS 84 are one; another that both have needs no shift.
  const bool one = a.datum == b.datum && a.ellipsoid == b.ellipsoid && a.shift == b.shift;
  if (one) {
    from.to_own_geographic(places);
    to.from_own_geographic(places);
  } else {
    from.to_geographic(places);
    to.from_geographic(places);
  }
}

}  // namespace terrace::terrain
