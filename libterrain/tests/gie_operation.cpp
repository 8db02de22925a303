// SPDX-License-Identifier: GPL-3.0-or-later
#include "gie_operation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include <GeographicLib/Geodesic.hpp>

#include "gie_parameters.hpp"

namespace terrace::terrain::gie {
namespace {

const std::set<std::string, std::less<>> kKnown{
    "proj",  "ellps",   "datum",  "a",       "b",     "rf",    "f",        "es",
    "R",     "lat_0",   "lon_0",  "lonc",    "lat_1", "lat_2", "lat_ts",   "k",
    "k_0",   "x_0",     "y_0",    "zone",    "south", "units", "to_meter", "alpha",
    "gamma", "towgs84", "no_def", "no_defs", "type",  "inv",   "init",     "algo"};

void read_method(const GieParameters& p, CrsDefinition& definition) {
  using M = ProjectionMethod;
  ProjectionParameters& to = definition.parameters;
  const std::string name = p.text("proj");
  to.latitude = p.number("lat_0", 0);
  to.longitude = p.number("lon_0", 0);
  to.scale = p.number("k_0", p.number("k", 1));
  to.false_easting = p.number("x_0", 0);
  to.false_northing = p.number("y_0", 0);
  to.parallel1 = p.number("lat_1", 0);
  if (name == "tmerc" || name == "etmerc") {
    definition.method = M::transverse_mercator;
  } else if (name == "utm") {
    const double zone = p.number("zone", 0);
    if (!(zone >= 1 && zone <= 60)) throw Unknown{"utm without a zone"};
    to = {.longitude = 6 * zone - 183,
          .scale = 0.9996,
          .false_easting = 500000,
          .false_northing = p.has("south") ? 1e7 : 0};
    definition.method = M::transverse_mercator;
  } else if (name == "ups") {
    to = {.latitude = p.has("south") ? -90.0 : 90.0,
          .scale = 0.994,
          .false_easting = 2e6,
          .false_northing = 2e6};
    definition.method = M::polar_stereographic_a;
  } else if (name == "lcc") {
    to.parallel2 = p.number("lat_2", to.parallel1);
    if (!p.has("lat_2")) to.latitude = p.number("lat_0", to.parallel1);
    definition.method = M::lambert_2sp;
  } else if (name == "aea") {
    to.parallel2 = p.number("lat_2", 0);
    if (p.has("lat_1") && to.parallel1 == -to.parallel2) throw Unknown{"aea of a cylinder"};
    definition.method = M::albers;
  } else if (name == "laea") {
    definition.method = M::lambert_azimuthal;
  } else if (name == "merc") {
    to.latitude = 0;
    to.parallel1 = p.number("lat_ts", 0);
    definition.method = p.has("lat_ts") ? M::mercator_b : M::mercator_a;
  } else if (name == "webmerc") {
    definition.method = M::web_mercator;
  } else if (name == "sterea") {
    definition.method = M::oblique_stereographic;
  } else if (name == "stere" && std::abs(to.latitude) == 90) {
    const auto true_scale = p.number("lat_ts");
    to.parallel1 = true_scale.value_or(to.latitude);
    definition.method = true_scale ? M::polar_stereographic_b : M::polar_stereographic_a;
  } else if (name == "stere") {
    throw Unknown{"stere that is not polar"};
  } else if (name == "omerc" && p.has("alpha")) {
    to.longitude = p.number("lonc", p.number("lon_0", 0));
    to.azimuth = p.number("alpha", 0);
    to.skew = p.number("gamma", to.azimuth);
    definition.method = M::hotine_b;
  } else if (name == "somerc") {
    // The Swiss grids are Hotine's to the east: EPSG:2056 is.
    if (to.latitude == 0) throw Unknown{"somerc on the equator (Mercator)"};
    to.azimuth = to.skew = 90;
    definition.method = M::hotine_b;
  } else if (name == "omerc") {
    throw Unknown{"omerc through two points or by gamma"};
  } else {
    throw Unknown{name};
  }
}

}  // namespace

std::optional<GieRun> GieRun::make(const std::string& operation, std::string& unknown) {
  GieRun run;
  bool pipeline = false;
  try {
    const GieSteps steps(operation);
    pipeline = steps.pipeline;
    for (const GieParameters& p : steps.steps) {
      const std::string name = p.text("proj"), init = p.text("init");
      // EPSG:4807 is in grads by itself.
      const bool grads =
          name == "unitconvert" && (p.text("xy_in") == "grad" || p.text("xy_out") == "grad");
      if (grads && pipeline) continue;
      if (init == "nad27:3901") {
        run.steps_.push_back({CoordinateSystem::parse("EPSG:32031"), p.has("inv"), false});
        continue;
      }
      if (init.starts_with("epsg:")) {
        if (init == "epsg:4978") throw Unknown{"geocentric coordinates (run apart)"};
        run.steps_.push_back({CoordinateSystem::parse(init), p.has("inv"), false});
        continue;
      }
      for (const auto& [key, value] : p.values()) {
        if (!kKnown.contains(key)) throw Unknown{name + " +" + key};
      }
      if (p.text("algo") == "evenden_snyder") throw Unknown{name + " +algo=evenden_snyder"};
      CrsDefinition definition;
      const bool nad27 = p.text("datum") == "NAD27";
      const bool plain =
          name == "longlat" || name == "latlong" || name == "latlon" || name == "lonlat";
      if (nad27 && plain) {
        run.steps_.push_back({CoordinateSystem::parse("EPSG:4267"), p.has("inv"), false});
        continue;
      }
      read_gie_ellipsoid(p, definition);
      if (!plain) read_method(p, definition);
      definition.metres_per_unit = gie_metres_per_unit(p);
      // PROJ's steps without a shift take longitudes and latitudes as they are.
      run.steps_.push_back(
          {CoordinateSystem(definition), p.has("inv"), definition.shift.has_value()});
    }
  } catch (const Unknown& what) {
    unknown = (pipeline ? "pipeline: " : "") + what.what;
    return std::nullopt;
  }
  for (std::size_t i = 1; i < run.steps_.size(); ++i) {
    const auto plane = [&](std::size_t k, bool behind) {
      return run.steps_[k].from != behind && !run.steps_[k].system.is_geographic();
    };
    if (plane(i - 1, true) != plane(i, false)) {
      unknown = "a pipeline from degrees to metres";
      return std::nullopt;
    }
  }
  return run;
}

Point2 GieRun::apply(Point2 place, bool inverse) const {
  const auto go = [&](const Step& step, bool from) {
    const std::span<Point2> one(&place, 1);
    if (step.shifted) {
      from ? step.system.to_geographic(one) : step.system.from_geographic(one);
    } else {
      from ? step.system.to_own_geographic(one) : step.system.from_own_geographic(one);
    }
  };
  if (inverse) {
    for (std::size_t i = steps_.size(); i-- > 0;) go(steps_[i], !steps_[i].from);
  } else {
    for (const Step& step : steps_) go(step, step.from);
  }
  return place;
}

double GieRun::distance(const Point2& a, const Point2& b, bool of_input) const {
  // Degrees are at the end that a projection does not make.
  const Step& step = of_input ? steps_.front() : steps_.back();
  const CrsDefinition& d = step.system.definition();
  if (step.from == of_input && d.method) return std::hypot(a[0] - b[0], a[1] - b[1]);
  const double unit = d.method ? 1 : d.degrees_per_unit;
  const GeographicLib::Geodesic earth(d.ellipsoid.semi_major, d.ellipsoid.flattening());
  double metres = 0;
  earth.Inverse(a[1] * unit, a[0] * unit, b[1] * unit, b[0] * unit, metres);
  return metres;
}

}  // namespace terrace::terrain::gie
