// SPDX-License-Identifier: Apache-2.0
#include "earth/crs/datum_change.hpp"

#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "earth/crs/definition.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

constexpr char kOwnDatum[] =
    R"(PROJCS["own grid",GEOGCS["own",DATUM["own datum",SPHEROID["own",6377000,300]],)"
    R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],)"
    R"(PARAMETER["central_meridian",-2],PARAMETER["latitude_of_origin",49],)"
    R"(PARAMETER["scale_factor",1],PARAMETER["false_easting",400000],)"
    R"(PARAMETER["false_northing",-100000],UNIT["metre",1]])";

TEST(DatumChange, UnknownDatumNeedsShift) {
  const CoordinateSystem bare = CoordinateSystem::parse(kOwnDatum);
  EXPECT_FALSE(bare.reaches_wgs84());
  try {
    static_cast<void>(bare.to_geographic(Point2{400000, 100000}));
    ADD_FAILURE() << "guessed";
  } catch (const stream::Error& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("own grid"), std::string::npos) << what;
    EXPECT_NE(what.find("`shift`"), std::string::npos) << what;
  }
  EXPECT_THROW(Transformation(bare, CoordinateSystem()), stream::Error);
  Point2 own{400000, -100000};
  bare.to_own_geographic({&own, 1});
  EXPECT_NEAR(own[0], -2, 1e-12);
  EXPECT_NEAR(own[1], 49, 1e-9);
}

// Ordnance Survey's Helmert transformation, OSGB36 to WGS 84: metres, arc seconds, ppm.
constexpr DatumShift kBritish{446.448, -125.157, 542.060, 0.1502, 0.2470, 0.8421, -20.4894};

TEST(DatumChange, ShiftOverridesDatabase) {
  const CoordinateSystem bare = CoordinateSystem::parse("EPSG:27700");
  const CoordinateSystem shifted = CoordinateSystem::parse("EPSG:27700", kBritish);
  EXPECT_FALSE(bare.same_places(shifted));
  // The result of cs2cs of PROJ 9.1.1, with +towgs84.
  const Point2 place = shifted.to_geographic(Point2{530000, 180000});
  EXPECT_NEAR(place[0], -0.1285, 1e-3);
  EXPECT_NEAR(place[1], 51.5037, 1e-3);
  const Point2 back = shifted.from_geographic(place);
  // Not exact: the height difference between the ellipsoids is ignored.
  EXPECT_NEAR(back[0], 530000, 0.01);
  EXPECT_NEAR(back[1], 180000, 0.01);
  // Repeats the conversion with the CRS as a store records it.
  const auto again = CoordinateSystem::of(shifted.crs(), "store");
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->same_places(shifted));
  EXPECT_EQ(again->to_geographic(Point2{530000, 180000}), place);
  // No operation is needed between systems of one datum.
  Point2 own{400000, 100000};
  Transformation(bare, CoordinateSystem::parse("EPSG:4277")).forward({&own, 1});
  EXPECT_NEAR(own[0], -2, 1e-12);
  // A shift is ignored for a system that counts as WGS 84.
  EXPECT_TRUE(CoordinateSystem::parse("EPSG:25832", kBritish)
                  .same_places(CoordinateSystem::parse("EPSG:25832")));
}

TEST(DatumChange, NamesOperationAndBetterAlternative) {
  const auto over = [](const char* text, double x, double y) {
    return CoordinateSystem::parse(text).over({{x, y, 0}, {x + 1000, y + 1000, 0}});
  };
  const CoordinateSystem etrs = over("EPSG:25832", 500000, 5200000);
  EXPECT_TRUE(etrs.counts_as_wgs84());
  EXPECT_EQ(etrs.to_wgs84().accuracy(), 1);
  EXPECT_EQ(CoordinateSystem().to_wgs84().accuracy(), 0);
  // The operation for all of Czechoslovakia is accurate to 6 m, the one for this place to 1 m.
  const CoordinateSystem krovak = over("EPSG:5514", -742000, -1043000);
  EXPECT_EQ(krovak.to_wgs84().accuracy(), 1) << krovak.wgs84_note();
  const CoordinateSystem british = over("EPSG:27700", 530000, 180000);
  EXPECT_EQ(british.to_wgs84().accuracy(), 2) << british.wgs84_note();
  EXPECT_NE(british.wgs84_note().find("OSGB36 to WGS 84"), std::string::npos);
  if (!british.to_wgs84().better().empty()) {
    EXPECT_NE(british.to_wgs84().better().find("OSTN15"), std::string::npos);
  }
  // Without the grid between the two Swiss datums the conversion goes through WGS 84, and says so.
  const Transformation swiss(over("EPSG:21781", 600000, 200000),
                             CoordinateSystem::parse("EPSG:2056"));
  EXPECT_NE(swiss.note().find("CH1903"), std::string::npos) << swiss.note();
  Point2 place{600000, 200000};
  swiss.forward({&place, 1});
  EXPECT_NEAR(place[0], 2600000, 2);
  EXPECT_NEAR(place[1], 1200000, 2);
}

/// The results of cs2cs of PROJ 9.1.1 with Debian's proj-data.
TEST(DatumChange, MatchesNationalGrids) {
  struct Grid {
    const char* crs;
    Point2 plane, own, wgs84;
  };
  const Grid grids[] = {
      {"EPSG:5514",
       {-742000, -1043000},
       {14.433532951, 50.089354245},
       {14.432438165, 50.088571828}},
      {"EPSG:27700", {530000, 180000}, {-0.126747680, 51.503480037}, {-0.128353940, 51.503990828}},
      {"EPSG:28992", {155000, 463000}, {5.387638889, 52.156160556}, {5.387203508, 52.155172301}},
      {"EPSG:2056", {2600000, 1200000}, {7.439583333, 46.952405556}, {7.438632421, 46.951082772}},
      {"EPSG:31370", {150000, 170000}, {4.367486482, 50.840956191}, {4.368752141, 50.840411283}},
  };
  for (const Grid& grid : grids) {
    SCOPED_TRACE(grid.crs);
    const Point2& p = grid.plane;
    const CoordinateSystem system =
        CoordinateSystem::parse(grid.crs).over({{p[0], p[1], 0}, {p[0] + 1, p[1] + 1, 0}});
    Point2 own = p;
    system.to_own_geographic({&own, 1});
    EXPECT_NEAR(own[0], grid.own[0], 1e-9);
    EXPECT_NEAR(own[1], grid.own[1], 1e-9);
    const Point2 place = system.to_geographic(p);
    EXPECT_NEAR(place[0], grid.wgs84[0], 1e-8);
    EXPECT_NEAR(place[1], grid.wgs84[1], 1e-8);
    const Point2 back = system.from_geographic(place);
    EXPECT_NEAR(back[0], p[0], 0.01);
    EXPECT_NEAR(back[1], p[1], 0.01);
  }
}

TEST(DatumShift, NeedsThreeOrSevenNumbers) {
  EXPECT_EQ(parse_datum_shift("1,2,3"), (DatumShift{1, 2, 3}));
  EXPECT_EQ(parse_datum_shift("1,2,3,4,5,6,7"), (DatumShift{1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(parse_datum_shift(""), std::nullopt);
  for (const char* text : {"1", "1,2", "1,2,3,4", "a,b,c", "1,2,3,4,5,6,7,8"}) {
    EXPECT_THROW(parse_datum_shift(text), UsageError) << text;
  }
}

}  // namespace
}  // namespace terrace::terrain
