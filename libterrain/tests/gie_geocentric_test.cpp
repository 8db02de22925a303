// SPDX-License-Identifier: GPL-3.0-or-later
// Geocentric coordinates, which are not those of any system here: the tiles' and, inside out, those
// of the shifts between datums.
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <string>

#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/Geodesic.hpp>
#include <gtest/gtest.h>

#include "earth/crs/coordinate_system.hpp"
#include "gie_file.hpp"
#include "gie_parameters.hpp"
#include "tile/format/ellipsoid.hpp"

namespace terrace::terrain::gie {
namespace {

using stream::Point3;

std::string folder() {
  const char* const data = std::getenv("TERRACE_DATA");
  return data == nullptr ? std::string() : std::string(data) + "/geodesy/";
}

double distance(const Point3& a, const Point3& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

double distance(const Point2& a, const Point2& b) {
  double metres = 0;
  GeographicLib::Geodesic::WGS84().Inverse(a[1], a[0], b[1], b[0], metres);
  return metres;
}

/// WGS 84's longitude and latitude of a place on another ellipsoid after a shift.
Point2 shifted(const Ellipsoid& ellipsoid, const DatumShift& shift, const Point2& place) {
  CrsDefinition definition;
  definition.ellipsoid = ellipsoid;
  definition.shift = shift;
  return CoordinateSystem(definition).to_geographic(place);
}

/// Longitude and latitude of a geocentric place: of the point that is carried there from (0, 0).
Point2 place_of(const Point3& p) {
  return shifted({}, {p[0] - kEquatorialRadius, p[1], p[2]}, {0, 0});
}

TEST(GeocentricData, TenThousandPlaces) {
  if (folder().empty()) GTEST_SKIP() << "TERRACE_DATA is not set";
  std::ifstream file(folder() + "xyz_to_llh_10_000.txt");
  Point3 xyz;
  double longitude = 0, latitude = 0, height = 0, worst_there = 0, worst_back = 0;
  std::size_t rows = 0;
  Point3 last = geocentric(10, 50, 0);
  Point2 last_place{10, 50};
  while (file >> xyz[0] >> xyz[1] >> xyz[2] >> longitude >> latitude >> height) {
    const Point2 place{longitude, latitude};
    worst_there = std::max(worst_there, distance(geocentric(longitude, latitude, height), xyz));
    worst_back = std::max(worst_back, distance(place_of(xyz), place));
    // A shift from the row before.
    const DatumShift shift{xyz[0] - last[0], xyz[1] - last[1], xyz[2] - last[2]};
    worst_back = std::max(worst_back, distance(shifted({}, shift, last_place), place));
    last = xyz;
    last_place = place;
    ++rows;
  }
  EXPECT_EQ(rows, 10000u);
  // Heights are written to a tenth of a millimetre, angles to a hundredth.
  EXPECT_LT(worst_there, 1e-4);
  EXPECT_LT(worst_back, 2e-4);
  std::cout << rows << " places: " << worst_there << " m there, " << worst_back << " m back\n";
}

/// PROJ's series 5201 of GIGS, between EPSG:4978 and 4326.
TEST(GeocentricData, GigsSeries5201) {
  if (folder().empty()) GTEST_SKIP() << "TERRACE_DATA is not set";
  const auto operations = read_gie(folder() + "proj/5201.gie");
  ASSERT_TRUE(operations);
  std::size_t run = 0, round_trips = 0;
  for (const GieOperation& operation : *operations) {
    const bool to_degrees = operation.text.find("4978") < operation.text.find("4326");
    for (const GieCase& one : operation.cases) {
      SCOPED_TRACE("line " + std::to_string(one.line));
      const std::vector<double>& in = one.accept;
      if (one.round_trips > 0) {
        ++round_trips;
        continue;
      }
      ASSERT_EQ(in.size(), 3u);
      ++run;
      if (to_degrees) {
        EXPECT_LE(distance(place_of({in[0], in[1], in[2]}), Point2{one.expect[0], one.expect[1]}),
                  one.tolerance);
      } else {
        EXPECT_LE(distance(geocentric(in[0], in[1], in[2]),
                           Point3{one.expect[0], one.expect[1], one.expect[2]}),
                  one.tolerance);
      }
    }
  }
  EXPECT_GE(run, 50u);
  std::cout << run << " cases run, " << round_trips
            << " round trips not ours: heights do not come back\n";
}

/// The seven parameters of a shift; nothing for another kind.
std::optional<DatumShift> shift_of(const GieParameters& p) {
  for (const auto& [key, value] : p.values()) {
    const bool known = key == "proj" || key == "convention" || key == "x" || key == "y" ||
                       key == "z" || key == "rx" || key == "ry" || key == "rz" || key == "s";
    if (!known) return std::nullopt;
  }
  // PROJ names what frame turns: the rotations are opposite.
  const double sign = p.text("convention") == "coordinate_frame" ? -1 : 1;
  return DatumShift{p.number("x", 0),         p.number("y", 0),         p.number("z", 0),
                    sign * p.number("rx", 0), sign * p.number("ry", 0), sign * p.number("rz", 0),
                    p.number("s", 0)};
}

/// PROJ's shifts between geocentric coordinates, each from an ellipsoid through the place itself,
/// since ours are of places on ellipsoids.
TEST(GeocentricData, ShiftsBySevenParameters) {
  if (folder().empty()) GTEST_SKIP() << "TERRACE_DATA is not set";
  const auto operations = read_gie(folder() + "proj/more_builtins.gie");
  ASSERT_TRUE(operations);
  std::size_t run = 0;
  std::map<std::string, std::size_t> others;
  for (const GieOperation& operation : *operations) {
    if (operation.text.find("proj=helmert") == std::string::npos) continue;
    SCOPED_TRACE("line " + std::to_string(operation.line) + ": " + operation.text);
    const GieSteps steps(operation.text);
    const auto shift = steps.pipeline ? std::nullopt : shift_of(steps.steps[0]);
    if (!shift || operation.refused) {
      others[operation.text] += std::max<std::size_t>(1, operation.cases.size());
      continue;
    }
    for (const GieCase& one : operation.cases) {
      SCOPED_TRACE("line " + std::to_string(one.line));
      const std::vector<double>&in = one.accept, &out = one.expect;
      ASSERT_TRUE(in.size() >= 3 && out.size() >= 3 && !one.inverse);
      Ellipsoid ellipsoid;
      const double axes = 1 - ellipsoid.flattening();
      ellipsoid.semi_major = std::hypot(in[0], in[1], in[2] / axes);
      const GeographicLib::Geocentric own(ellipsoid.semi_major, ellipsoid.flattening());
      const GeographicLib::Geocentric& wgs84 = GeographicLib::Geocentric::WGS84();
      Point2 from{}, to{};
      double height = 0;
      own.Reverse(in[0], in[1], in[2], from[1], from[0], height);
      ASSERT_NEAR(height, 0, 1e-6);
      wgs84.Reverse(out[0], out[1], out[2], to[1], to[0], height);
      EXPECT_LE(distance(shifted(ellipsoid, *shift, from), to), one.tolerance);
      ++run;
    }
  }
  std::cout << run << " cases run\n";
  for (const auto& [what, cases] : others) {
    std::cout << "  not ours: " << what << " (" << cases << " cases)\n";
  }
  EXPECT_GE(run, 1u);
}

}  // namespace
}  // namespace terrace::terrain::gie
