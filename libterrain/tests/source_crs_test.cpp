// SPDX-License-Identifier: Apache-2.0
#include "earth/source_crs.hpp"

#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "earth/crs/definition.hpp"
#include "earth/ground.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {
namespace {

/// A table whose columns of x and y name this unit, in the CRS that the caller names.
stream::SourceInfo table(const std::string& unit, const std::string& crs) {
  stream::SourceInfo info;
  info.files = {"points.csv"};
  info.crs = crs_named(crs);
  info.coordinates[0].unit = info.coordinates[1].unit = unit;
  return info;
}

constexpr char kSite[] = R"(LOCAL_CS["site",UNIT["metre",1]])";

TEST(SourceCrs, RefusesColumnsInAnotherUnitThanTheCrs) {
  struct Wrong {
    const char *unit, *crs, *named;
  };
  for (const Wrong& wrong :
       {Wrong{"foot", "EPSG:32632", "feet"}, Wrong{"metre", "EPSG:2263", "US survey feet"},
        Wrong{"US survey foot", "EPSG:2222", "feet"}, Wrong{"degree", "EPSG:32632", "degrees"},
        Wrong{"metre", "EPSG:4326", "degrees"}, Wrong{"foot", kSite, "metres"}}) {
    SCOPED_TRACE(std::string(wrong.unit) + " in " + wrong.crs);
    try {
      static_cast<void>(crs_of_source(table(wrong.unit, wrong.crs)));
      ADD_FAILURE() << "accepted";
    } catch (const stream::Error& error) {
      const std::string what = error.what();
      EXPECT_NE(what.find("points.csv"), std::string::npos) << what;
      EXPECT_NE(what.find(plural_unit(wrong.unit)), std::string::npos) << what;
      EXPECT_NE(what.find(wrong.named), std::string::npos) << what;
    }
  }
}

TEST(SourceCrs, AcceptsColumnsInTheUnitOfTheCrs) {
  for (const auto& [unit, crs] : {std::pair{"metre", "EPSG:32632"},
                                  {"US survey foot", "EPSG:2263"},
                                  {"foot", "EPSG:2222"},
                                  {"degree", "EPSG:4326"},
                                  {"", "EPSG:32632"},
                                  {"metre", kSite},
                                  // Tables hardly ever distinguish the two feet.
                                  {"foot", "EPSG:2263"}}) {
    EXPECT_NO_THROW(crs_of_source(table(unit, crs))) << unit << " in " << crs;
  }
  stream::SourceInfo bare;
  bare.coordinates[0].unit = bare.coordinates[1].unit = bare.crs.horizontal_unit = "foot";
  EXPECT_NO_THROW(crs_of_source(bare));
}

constexpr char kUtm[] = R"(PROJCRS["own",BASEGEOGCRS["WGS 84",DATUM["World Geodetic System 1984",)"
                        R"(ELLIPSOID["WGS 84",6378137,298.257223563]]],CONVERSION["c",)"
                        R"(METHOD["Transverse Mercator",ID["EPSG",9807]],)"
                        R"(PARAMETER["Longitude of natural origin",9],)"
                        R"(PARAMETER["Scale factor at natural origin",0.9996],)"
                        R"(PARAMETER["False easting",500000]],)";

/// The unit of heights in a WKT reaches the record, and from there the ground.
TEST(SourceCrs, KeepsTheUnitOfHeightsInWkt) {
  const std::string flat =
      std::string(kUtm) +
      R"(CS[Cartesian,2],AXIS["x",east],AXIS["y",north],LENGTHUNIT["metre",1]])";
  const auto axes = [](const std::string& unit) {
    return R"(CS[Cartesian,3],AXIS["x",east,LENGTHUNIT["metre",1]],)"
           R"(AXIS["y",north,LENGTHUNIT["metre",1]],AXIS["z",up,LENGTHUNIT[)" +
           unit + "]]]";
  };
  const auto compound = [&](const std::string& horizontal, const std::string& unit) {
    return "COMPOUNDCRS[\"c\"," + horizontal +
           R"(,VERTCRS["h",VDATUM["d"],CS[vertical,1],AXIS["H",up],LENGTHUNIT[)" + unit + "]]]";
  };
  struct Unit {
    const char* wkt;
    double metres;
  };
  for (const Unit& unit :
       {Unit{R"("foot",0.3048)", 0.3048},
        Unit{R"("US survey foot",0.304800609601219)", 1200.0 / 3937.0},
        Unit{R"("Indian foot",0.304799510248147)", 0.304799510248147}, Unit{R"("metre",1)", 1}}) {
    const std::string site = R"(ENGCRS["site",EDATUM["d"],)";
    for (const std::string& wkt :
         {compound(flat, unit.wkt), std::string(kUtm) + axes(unit.wkt), site + axes(unit.wkt),
          compound(
              site + R"(CS[Cartesian,2],AXIS["x",east],AXIS["y",north],LENGTHUNIT["metre",1]])",
              unit.wkt)}) {
      SCOPED_TRACE(wkt);
      stream::SourceInfo info;
      info.crs = crs_named(wkt);
      const SourceCrs found = crs_of_source(info);
      stream::Placement placement;
      placement.crs = found.crs;
      const Ground ground(placement);
      EXPECT_NEAR(ground.metres_vertical(), unit.metres, 1e-12);
      EXPECT_EQ(ground.unknown_height_unit(), "");
    }
  }
}

/// Some programs write heights above the ellipsoid as a vertical CRS of that name.
TEST(SourceCrs, KeepsEllipsoidalHeightsOfVerticalCrs) {
  stream::SourceInfo info;
  info.crs = crs_named(
      R"--(COMPOUNDCRS["c",GEOGCRS["WGS 84",DATUM["World Geodetic System 1984",)--"
      R"--(ELLIPSOID["WGS 84",6378137,298.257223563]],CS[ellipsoidal,2],AXIS["lat",north],)--"
      R"--(AXIS["lon",east],ANGLEUNIT["degree",0.0174532925199433]],)--"
      R"--(VERTCRS["Ellipsoid height (ft)",VDATUM["Ellipsoid"],CS[vertical,1],AXIS["h",up],)--"
      R"--(LENGTHUNIT["foot",0.3048]]])--");
  const SourceCrs found = crs_of_source(info);
  EXPECT_EQ(found.heights, Heights::ellipsoidal);
  EXPECT_EQ(found.crs.vertical_unit, "foot");
}

}  // namespace
}  // namespace terrace::terrain
