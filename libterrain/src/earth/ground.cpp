// SPDX-License-Identifier: Apache-2.0
#include "earth/ground.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <system_error>
#include <utility>

#include <GeographicLib/Constants.hpp>
#include <terrace/base/portable_math.hpp>

#include "base/units.hpp"
#include "earth/crs/definition.hpp"
#include "terrace/stream/unit_words.hpp"

namespace terrace::terrain {
namespace {

struct UnitName {
  std::string_view name;
  double metres;
};

// The names that stream::canonical_unit() returns.
constexpr double kSurveyFoot = 1200.0 / 3937.0;
constexpr std::array<UnitName, 18> kUnits{{
    {"metre", 1.0},
    {"foot", 0.3048},
    {"US survey foot", kSurveyFoot},
    {"kilometre", 1000.0},
    {"hectometre", 100.0},
    {"decametre", 10.0},
    {"decimetre", 0.1},
    {"centimetre", 0.01},
    {"millimetre", 0.001},
    {"inch", 0.0254},
    {"US survey inch", kSurveyFoot / 12.0},
    {"yard", 0.9144},
    {"US survey yard", kSurveyFoot * 3.0},
    {"fathom", 1.8288},
    {"mile", 1609.344},
    {"US survey mile", kSurveyFoot * 5280.0},
    {"nautical mile", 1852.0},
    {"Clarke's foot", 0.3047972654},
}};

bool same_text(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](char x, char y) { return lower(x) == lower(y); });
}

}  // namespace

MetresPerDegree metres_per_degree(double latitude) {
  // Radii of the parallel and the meridian: Snyder, Map Projections - A Working Manual (1987), USGS
  // Professional Paper 1395, equations 4-19 to 4-21.
  const double a = GeographicLib::Constants::WGS84_a();
  const double f = GeographicLib::Constants::WGS84_f();
  const double e2 = f * (2.0 - f);
  const double phi = std::clamp(latitude, -90.0, 90.0);
  const double sine = base::sin_degrees(phi);
  const double w2 = 1.0 - e2 * sine * sine;
  const double w = std::sqrt(w2);
  return {.longitude = base::kRadiansPerDegree * a * base::cos_degrees(phi) / w,
          .latitude = base::kRadiansPerDegree * a * (1.0 - e2) / (w2 * w)};
}

std::optional<double> metres_in_unit(std::string_view unit) {
  const std::string name = stream::canonical_unit(unit);
  for (const UnitName& known : kUnits) {
    if (name == known.name) return known.metres;
  }
  double metres = 0;
  const char* const end = unit.data() + unit.size();
  const auto [rest, error] = std::from_chars(unit.data(), end, metres);
  if (error == std::errc{} && std::string_view(rest, end) == " m" && metres > 0 &&
      std::isfinite(metres)) {
    return metres;
  }
  return std::nullopt;
}

std::string recorded_unit(double metres) {
  const std::string name = unit_name(metres);
  return name.empty() ? number_text(metres) + " m" : name;
}

std::string unit_name(double metres) {
  for (const UnitName& known : kUnits) {
    if (std::abs(metres / known.metres - 1) < 1e-9) return std::string(known.name);
  }
  return {};
}

std::string plural_unit(const std::string& unit) {
  if (unit.ends_with(" m")) return "units of " + unit;
  if (unit.ends_with("foot")) return unit.substr(0, unit.size() - 4) + "feet";
  if (unit.ends_with("inch")) return unit + "es";
  return unit.ends_with('s') || unit.ends_with("feet") ? unit : unit + "s";
}

Ground::Ground(stream::Placement placement, double z_weight) : placement_(std::move(placement)) {
  const stream::Crs& crs = placement_.crs;
  const auto assume = [this](const std::string& what) {
    assumption_ += (assumption_.empty() ? "" : "; ") + what;
  };

  const bool degrees =
      same_text(crs.horizontal_unit, "degree") ||
      (crs.horizontal_unit.empty() && same_text(placement_.coordinates[0].unit, "degree"));
  std::optional<CrsDefinition> known;
  try {
    known = definition_of(crs);
    if (known && !known->geographic) system_.emplace(*known);
  } catch (const CrsError&) {
    // The unit is still used; callers that need positions report the error.
  }
  if (crs.geographic || degrees) {
    kind_ = Kind::geographic;
    if (known && known->geographic) degrees_ = known->degrees_per_unit;
  } else if (crs.epsg == 3857 || crs.epsg == 3785 || crs.epsg == 900913) {
    kind_ = Kind::web_mercator;
  } else if (system_) {
    kind_ = Kind::projected;
    metres_horizontal_ = known->metres_per_unit;
  } else if (const auto metres = metres_in_unit(crs.horizontal_unit)) {
    metres_horizontal_ = *metres;
  } else if (const auto stored = metres_in_unit(placement_.coordinates[0].unit)) {
    metres_horizontal_ = *stored;
  } else {
    assume("the horizontal unit is unknown and taken as metres");
  }

  // Prefer the unit that the heights name, then the unit of a CRS in feet, then metres.
  const std::string& named_unit = placement_.coordinates[2].unit;
  // A file may name the unit only in its WKT.
  const double of_heights = crs.vertical_unit.empty() && known ? known->metres_per_height : 0;
  const std::string of_crs = of_heights != 0 ? recorded_unit(of_heights) : crs.vertical_unit;
  const std::string& word = named_unit.empty() ? of_crs : named_unit;
  const bool unknown = !word.empty() && !metres_in_unit(word);
  std::string assumed = "metres";
  if (const auto channel = metres_in_unit(named_unit)) {
    metres_vertical_ = *channel;
    height_unit_ = named_unit;
  } else if (const auto vertical = metres_in_unit(of_crs)) {
    metres_vertical_ = *vertical;
    height_unit_ = of_crs;
    assumed = "the vertical unit of the CRS";
  } else if (kind_ != Kind::geographic && metres_horizontal_ < 1.0) {
    metres_vertical_ = metres_horizontal_;
    height_unit_ =
        crs.horizontal_unit.empty() ? unit_name(metres_horizontal_) : crs.horizontal_unit;
    assumed = "that of x and y";
    if (!unknown) assume("the unit of heights is unknown and taken as " + assumed);
  }
  if (unknown) {
    unknown_height_unit_ =
        "the unit of heights, \"" + word + "\", is not known and taken as " + assumed;
    assume(unknown_height_unit_);
  }
  metres_vertical_ *= z_weight;
}

/// Returns the east, mixed and north terms of the symmetric map from a step in x, y to metres: the
/// square root of the ellipsoid's metric in the plane.
std::array<double, 3> Ground::projected_scale(const stream::Point3& centre) const {
  const double unit = metres_horizontal_;
  // With a step of a hundred metres the slopes have nine correct digits.
  const double step = 100.0 / unit;
  std::array<Point2, 5> places{{{centre[0], centre[1]},
                                {centre[0] - step, centre[1]},
                                {centre[0] + step, centre[1]},
                                {centre[0], centre[1] - step},
                                {centre[0], centre[1] + step}}};
  system_->to_own_geographic(places);
  const MetresPerDegree metres = metres_per_degree(places[0][1]);
  const auto slope = [&](std::size_t from, std::size_t to) -> Point2 {
    const double turn = std::remainder(places[to][0] - places[from][0], 360.0);
    return {turn * metres.longitude / (2 * step),
            (places[to][1] - places[from][1]) * metres.latitude / (2 * step)};
  };
  const Point2 x = slope(1, 2), y = slope(3, 4);
  const double xx = x[0] * x[0] + x[1] * x[1], yy = y[0] * y[0] + y[1] * y[1];
  const double xy = x[0] * y[0] + x[1] * y[1];
  const double root = std::sqrt(std::max(0.0, xx * yy - xy * xy));
  const double sum = std::sqrt(xx + yy + 2 * root);
  // Projections call the C library's functions. Rounding to five digits keeps their last bits from
  // affecting clusters.
  const auto rounded = [&](double value) { return std::round(value / unit * 0x1p16) * 0x1p-16; };
  const std::array<double, 3> scale{rounded((xx + root) / sum), rounded(xy / sum),
                                    rounded((yy + root) / sum)};
  // Fails outside the projection's area, and at a pole, where longitudes are undefined.
  const bool usable = scale[0] > 0.01 && scale[2] > 0.01 && scale[0] < 100 && scale[2] < 100 &&
                      std::abs(scale[1]) < 0.5 * std::min(scale[0], scale[2]);
  if (!usable) return {unit, 0, unit};
  return {scale[0] * unit, scale[1] * unit, scale[2] * unit};
}

GroundMap Ground::map(const stream::Box3& stored) const {
  double east = metres_horizontal_, north = metres_horizontal_, mixed = 0;
  if (kind_ != Kind::linear && !stored.empty()) {
    const stream::Point3 centre =
        world_point(placement_, {0.5 * (stored.min[0] + stored.max[0]),
                                 0.5 * (stored.min[1] + stored.max[1]), stored.min[2]});
    if (kind_ == Kind::geographic) {
      const MetresPerDegree metres = metres_per_degree(centre[1] * degrees_);
      east = metres.longitude * degrees_;
      north = metres.latitude * degrees_;
    } else if (kind_ == Kind::projected) {
      const std::array<double, 3> scale = projected_scale(centre);
      east = scale[0];
      mixed = scale[1];
      north = scale[2];
    } else {
      // y = a ln tan(pi/4 + phi/2), so cos(phi) = 1 / cosh(y/a). One metre in the map is rho
      // cos(phi)/a metres north on the ground, and N cos(phi)/a metres east.
      const double a = GeographicLib::Constants::WGS84_a();
      const double growth = base::exp(-std::abs(centre[1]) / a);
      const double cosine = 2.0 * growth / (1.0 + growth * growth);
      const double f = GeographicLib::Constants::WGS84_f();
      const double e2 = f * (2.0 - f);
      const double w2 = 1.0 - e2 * (1.0 - cosine * cosine);
      const double w = std::sqrt(w2);
      east = cosine / w;
      north = cosine * (1.0 - e2) / (w2 * w);
    }
  }
  const std::array<double, 6>& xy = placement_.world.xy;
  const double height = metres_vertical_ * placement_.coordinates[2].scale;
  if (mixed == 0) {
    return {east * xy[0], east * xy[1], 0, north * xy[3], north * xy[4], 0, 0, 0, height};
  }
  return {east * xy[0] + mixed * xy[3],
          east * xy[1] + mixed * xy[4],
          0,
          mixed * xy[0] + north * xy[3],
          mixed * xy[1] + north * xy[4],
          0,
          0,
          0,
          height};
}

void say_unknown_height_unit(const Ground& ground, const Context& context) {
  if (!ground.unknown_height_unit().empty()) context.say(ground.unknown_height_unit());
}

stream::Point3 apply(const GroundMap& map, const stream::Point3& v) {
  return {map[0] * v[0] + map[1] * v[1] + map[2] * v[2],
          map[3] * v[0] + map[4] * v[1] + map[5] * v[2],
          map[6] * v[0] + map[7] * v[1] + map[8] * v[2]};
}

}  // namespace terrace::terrain
