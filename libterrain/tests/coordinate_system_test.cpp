// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "earth/crs/crs_definition.hpp"
#include "earth/crs/datum_change.hpp"
#include "temporary_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// The CRS of a file that contains only WKT, or only a code.
stream::Crs crs_of_wkt(const std::string& wkt) {
  stream::Crs crs;
  crs.wkt = wkt;
  return crs;
}
stream::Crs crs_of_code(int code) {
  stream::Crs crs;
  crs.epsg = code;
  return crs;
}

TEST(CoordinateSystem, KnowsUnitsOfCodes) {
  for (const char* code : {"EPSG:4326", "epsg:4258", "EPSG:4269", "EPSG:4979"}) {
    EXPECT_TRUE(CoordinateSystem::parse(code).is_geographic()) << code;
    EXPECT_EQ(CoordinateSystem::parse(code).crs().horizontal_unit, "degree");
  }
  for (const char* code : {"EPSG:32632", "EPSG:25833", "EPSG:3857", "EPSG:2056"}) {
    EXPECT_FALSE(CoordinateSystem::parse(code).is_geographic()) << code;
    EXPECT_EQ(CoordinateSystem::parse(code).crs().horizontal_unit, "metre") << code;
  }
  EXPECT_EQ(CoordinateSystem::parse("EPSG:2263").crs().horizontal_unit, "US survey foot");
  EXPECT_EQ(CoordinateSystem::parse("EPSG:2222").crs().horizontal_unit, "foot");
  EXPECT_EQ(CoordinateSystem::parse("EPSG:32632").crs().epsg, 32632);
  EXPECT_EQ(CoordinateSystem::parse("EPSG:900913").crs().epsg, 3857);
}

TEST(CoordinateSystem, RejectsInvalidText) {
  for (const char* text : {"", "32632", "EPSG:", "EPSG:x", "EPSG:12", "EPSG:99999", "EPSG:4326 ",
                           "EPSG:4326+", "EPSG:4326+4326", "EPSG:5703", "no/such/file.prj",
                           "PROJCS[\"x\"", "GEOGCS[\"x\"]", "LOCAL_CS[\"x\",UNIT[\"metre\",1]]",
                           "[]", "GEOGCS[[[[", "(((((((((((((((((((((((((((((((((((((((((("}) {
    EXPECT_THROW(CoordinateSystem::parse(text), UsageError) << text;
  }
}

TEST(CoordinateSystem, ReadsOldArcInfoFiles) {
  const tests::TemporaryFolder folder;
  const std::string path = (folder.path() / "dem.prj").string();
  const auto code_of = [&](const std::string& text) {
    std::ofstream(path) << text;
    return CoordinateSystem::parse(path).crs().epsg;
  };
  const std::string geographic =
      "Projection    GEOGRAPHIC\nDatum         WGS84\nUnits         DD\n";
  EXPECT_EQ(code_of(geographic + "Zunits        METERS\nXshift 0.0\nYshift 0.0\nParameters\n"),
            4326);
  const std::string utm = "PROJECTION UTM\r\nUNITS METERS\r\nZUNITS NO\r\n";
  EXPECT_EQ(code_of(utm + "ZONE 33\r\nDATUM WGS84\r\nYSHIFT 0.0\r\n"), 32633);
  EXPECT_EQ(code_of(utm + "ZONE 18\r\nDATUM WGS84\r\nYSHIFT -10000000.0\r\n"), 32718);
  EXPECT_EQ(code_of(utm + "ZONE 10\r\nDATUM NAD27\r\n"), 26710);
  for (const std::string& text :
       {utm + "DATUM WGS84\n", utm + "ZONE 61\nDATUM WGS84\n", utm + "ZONE 18\nDATUM EUR\n",
        utm + "ZONE 18\nDATUM NAD83\nYSHIFT -10000000\n", utm + "ZONE 18\nDATUM WGS84\nXSHIFT 5\n",
        std::string("Projection GEOGRAPHIC\nDatum WGS84\nUnits DS\n"),
        std::string("Projection GEOGRAPHIC\nDatum WGS84\nUnits DD\nZunits FEET\n"),
        std::string("Projection GEOGRAPHIC\nDatum WGS84\nUnits DD\nYshift +10000000\n"),
        std::string("Projection ALBERS\nDatum WGS84\nUnits METERS\n"), std::string("Projection")}) {
    EXPECT_THROW(code_of(text), UsageError) << text;
  }
}

TEST(CoordinateSystem, ReadsCommonSpellings) {
  const CoordinateSystem known = CoordinateSystem::parse("EPSG:32632");
  const std::string json =
      R"({"type":"ProjectedCRS","name":"zone 32","base_crs":{"name":"WGS 84","datum":{"type":)"
      R"("GeodeticReferenceFrame","name":"World Geodetic System 1984","ellipsoid":{"name":"WGS 84",)"
      R"("semi_major_axis":6378137,"inverse_flattening":298.257223563}},"coordinate_system":)"
      R"({"subtype":"ellipsoidal","axis":[{"name":"latitude","abbreviation":"lat","direction":)"
      R"("north","unit":"degree"},{"name":"longitude","abbreviation":"lon","direction":"east",)"
      R"("unit":"degree"}]}},"conversion":{"name":"zone 32","method":{"name":)"
      R"("Transverse Mercator","id":{"authority":"EPSG","code":9807}},"parameters":[{"name":)"
      R"("Latitude of natural origin","value":0,"unit":"degree"},{"name":)"
      R"("Longitude of natural origin","value":9,"unit":"degree"},{"name":)"
      R"("Scale factor at natural origin","value":0.9996,"unit":"unity"},{"name":"False easting",)"
      R"("value":500000,"unit":"metre"},{"name":"False northing","value":0,"unit":"metre"}]},)"
      R"("coordinate_system":{"subtype":"Cartesian","axis":[{"name":"Easting","abbreviation":"E",)"
      R"("direction":"east","unit":"metre"},{"name":"Northing","abbreviation":"N","direction":)"
      R"("north","unit":"metre"}]}})";
  for (const std::string& text :
       {std::string("WGS 84 / UTM zone 32N"), std::string("urn:ogc:def:crs:EPSG::32632"),
        std::string("+proj=utm +zone=32 +datum=WGS84"), known.crs().wkt, json}) {
    const CoordinateSystem read = CoordinateSystem::parse(text);
    EXPECT_TRUE(read.same_places(known)) << text;
    EXPECT_EQ(read.crs().epsg, 32632) << text;
  }
  const CoordinateSystem esri = CoordinateSystem::parse("ESRI:54030");
  EXPECT_EQ(esri.crs().epsg, 0);
  EXPECT_EQ(esri.title(), "ESRI:54030 (World_Robinson)");
  EXPECT_TRUE(CoordinateSystem::of(esri.crs(), "store")->same_places(esri));
}

/// The records in LAS, LAZ, COPC and GeoTIFF are read as the same system, whatever the directions
/// of its axes.
TEST(CoordinateSystem, ReadsBackRecordsOfFiles) {
  for (const char* const code :
       {"EPSG:5513", "EPSG:2065", "EPSG:8352", "EPSG:8044", "EPSG:8045", "EPSG:5514", "EPSG:2053",
        "EPSG:32632", "EPSG:25832+7837", "EPSG:4326", "EPSG:4979", "EPSG:31468", "ESRI:102067"}) {
    SCOPED_TRACE(code);
    const CoordinateSystem known = CoordinateSystem::parse(code);
    const auto read = CoordinateSystem::of(crs_of_wkt(known.crs_with_wkt1().wkt), "file");
    ASSERT_TRUE(read);
    EXPECT_TRUE(read->same_places(known));
    EXPECT_EQ(read->crs().epsg, known.crs().epsg);
    EXPECT_EQ(read->heights(), known.heights());
    const auto keyed = CoordinateSystem::of(known.crs_with_keys(), "file");
    ASSERT_TRUE(keyed);
    EXPECT_TRUE(keyed->same_places(known));
  }
  // WKT 1 if it can express the system.
  EXPECT_TRUE(CoordinateSystem::parse("EPSG:32632").crs_with_wkt1().wkt.starts_with("PROJCS["));
}

/// One system in the spellings of different files.
TEST(CoordinateSystem, RecognisesEqualDescriptions) {
  const CoordinateSystem utm = CoordinateSystem::parse("EPSG:25832");
  const auto keys = [](std::vector<std::pair<std::uint16_t, double>> values) {
    stream::Crs crs;
    for (const auto& [key, value] : values) {
      if (key == 3072) crs.epsg = static_cast<int>(value);
      crs.geo_keys.push_back({.key = key, .values = {value}, .text = {}});
    }
    return crs;
  };
  std::string esri = utm.crs_with_wkt1().wkt, shifted = esri;
  const std::size_t datum_end = shifted.find("]],PRIMEM");
  ASSERT_NE(datum_end, shifted.npos);
  shifted.insert(datum_end + 1, ",TOWGS84[0,0,0,0,0,0,0]");
  for (std::size_t at = esri.find(",AUTHORITY"); at != esri.npos; at = esri.find(",AUTHORITY")) {
    esri.erase(at, esri.find(']', at) + 1 - at);
  }
  const std::vector<stream::Crs> same{keys({{1024, 1}, {3072, 25832}}),
                                      keys({{1024, 1}, {3072, 25832}, {3076, 9001}}),
                                      crs_of_wkt(utm.crs().wkt),
                                      crs_of_wkt(utm.crs_with_wkt1().wkt),
                                      crs_of_wkt(esri),
                                      crs_of_wkt(shifted),
                                      utm.crs()};
  for (const stream::Crs& a : same) {
    for (const stream::Crs& b : same) EXPECT_TRUE(same_crs(a, b)) << a.wkt << '\n' << b.wkt;
  }
  for (const stream::Crs& other :
       {CoordinateSystem::parse("EPSG:25833").crs(), CoordinateSystem::parse("EPSG:32632").crs(),
        CoordinateSystem::parse("EPSG:25832+7837").crs(),
        keys({{1024, 1}, {3072, 25832}, {3076, 9002}}), stream::Crs{}}) {
    EXPECT_FALSE(same_crs(other, same.front())) << other.wkt;
    EXPECT_FALSE(same_crs(same.back(), other)) << other.wkt;
  }
}

TEST(CoordinateSystem, NamesGeocentricSystems) {
  const stream::Crs crs = crs_named("EPSG:4978");
  EXPECT_EQ(crs.epsg, 0);
  EXPECT_EQ(crs.horizontal_unit, "metre");
  EXPECT_EQ(crs.vertical_unit, "metre");
  EXPECT_TRUE(crs.wkt.starts_with("GEODCRS[")) << crs.wkt;
  EXPECT_FALSE(CoordinateSystem::of(crs, "store"));
  EXPECT_FALSE(CoordinateSystem::of(crs_of_code(4978), "file"));
  EXPECT_THROW(CoordinateSystem::parse("EPSG:4978"), UsageError);
}

TEST(CoordinateSystem, ReadsHeightReferenceOfCodes) {
  const auto heights = [](const char* text) { return CoordinateSystem::parse(text).heights(); };
  EXPECT_EQ(heights("EPSG:32632"), Heights::unknown);
  EXPECT_EQ(heights("EPSG:4979"), Heights::ellipsoidal);
  EXPECT_EQ(heights("EPSG:32632+5773"), Heights::orthometric);
  EXPECT_EQ(heights("EPSG:4326+5030"), Heights::ellipsoidal);
  EXPECT_EQ(heights("EPSG:4326+4979"), Heights::ellipsoidal);  // as GeoTIFF 1.1 uses EPSG:4979
  EXPECT_EQ(heights("EPSG:5555"), Heights::orthometric);       // compound: UTM 32 and DHHN92
  EXPECT_EQ(CoordinateSystem::parse("EPSG:5555").crs().epsg, 25832);
  EXPECT_EQ(CoordinateSystem::parse("EPSG:5555").crs().vertical_epsg, 5783);
  EXPECT_EQ(CoordinateSystem::parse("EPSG:4326+6360").crs().vertical_unit, "US survey foot");
  for (const char* code : {"5703", "5773", "3855", "5782", "5783", "5705"}) {
    EXPECT_EQ(heights((std::string("EPSG:4326+") + code).c_str()), Heights::orthometric) << code;
  }
  EXPECT_THROW(heights("EPSG:4326+5715"), UsageError) << "depths";
}

// Guidance Note 7-2 (2019), the examples of sections 3.1 to 3.5 that have an EPSG code.
TEST(CoordinateSystem, MatchesExamplesOfGuidanceNote) {
  struct Example {
    const char* crs;
    Point2 degrees, plane;
    double tolerance;
  };
  const double minute = 1.0 / 60, second = 1.0 / 3600;
  const Example examples[] = {
      {"EPSG:3035", {5, 50}, {3962799.45, 2999718.85}, 0.01},
      {"EPSG:28992", {6, 53}, {196105.283, 557057.739}, 0.001},
      {"EPSG:27700", {0.5, 50.5}, {577274.99, 69740.50}, 0.01},
      {"EPSG:5041", {44, 73}, {3320416.75, 632668.43}, 0.01},
      {"EPSG:3857",
       {-(100 + 20 * minute), 24 + 22 * minute + 54.433 * second},
       {-11169055.58, 2800000.00},
       0.01},
  };
  for (const Example& example : examples) {
    SCOPED_TRACE(example.crs);
    const CoordinateSystem system = CoordinateSystem::parse(example.crs);
    Point2 place = example.degrees;
    system.from_own_geographic({&place, 1});
    EXPECT_NEAR(place[0], example.plane[0], example.tolerance);
    EXPECT_NEAR(place[1], example.plane[1], example.tolerance);
    system.to_own_geographic({&place, 1});
    // A tenth of a micrometre for GeographicLib, a millimetre for PROJ's series for equal areas.
    const double exact = system.definition().method ? 1e-12 : 1e-8;
    EXPECT_NEAR(place[0], example.degrees[0], exact);
    EXPECT_NEAR(place[1], example.degrees[1], exact);
  }
}

TEST(CoordinateSystem, ReadsOtherWktDialects) {
  const auto same = [](const std::string& wkt, const char* code) {
    const CoordinateSystem read = CoordinateSystem::parse(wkt),
                           known = CoordinateSystem::parse(code);
    EXPECT_TRUE(read.same_places(known)) << wkt;
    EXPECT_EQ(read.to_wgs84().name(), known.to_wgs84().name()) << wkt;
  };
  const std::string wgs84 =
      R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],)"
      R"(PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]])";
  const std::string nad83 =
      R"(GEOGCS["GCS_North_American_1983",DATUM["D_North_American_1983",SPHEROID["GRS_1980",)"
      R"(6378137.0,298.257222101]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]])";
  same(wgs84, "EPSG:4326");
  // ESRI's form.
  same("PROJCS[\"WGS_1984_UTM_Zone_32N\"," + wgs84 +
           R"(,PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",500000.0],)"
           R"(PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",9.0],)"
           R"(PARAMETER["Scale_Factor",0.9996],PARAMETER["Latitude_Of_Origin",0.0],)"
           R"(UNIT["Meter",1.0]])",
       "EPSG:32632");
  same("PROJCS[\"WGS_1984_Web_Mercator_Auxiliary_Sphere\"," + wgs84 +
           R"(,PROJECTION["Mercator_Auxiliary_Sphere"],PARAMETER["False_Easting",0.0],)"
           R"(PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",0.0],)"
           R"(PARAMETER["Standard_Parallel_1",0.0],PARAMETER["Auxiliary_Sphere_Type",0.0],)"
           R"(UNIT["Meter",1.0]])",
       "EPSG:3857");
  same("PROJCS[\"NAD_1983_StatePlane_New_York_Long_Island_FIPS_3104_Feet\"," + nad83 +
           R"(,PROJECTION["Lambert_Conformal_Conic"],PARAMETER["False_Easting",984250.0],)"
           R"(PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",-74.0],)"
           R"(PARAMETER["Standard_Parallel_1",40.66666666666666],)"
           R"(PARAMETER["Standard_Parallel_2",41.03333333333333],)"
           R"(PARAMETER["Latitude_Of_Origin",40.16666666666666],)"
           R"(UNIT["Foot_US",0.3048006096012192]])",
       "EPSG:2263");
  same("PROJCS[\"WGS_1984_Antarctic_Polar_Stereographic\"," + wgs84 +
           R"(,PROJECTION["Stereographic_South_Pole"],PARAMETER["False_Easting",0.0],)"
           R"(PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",0.0],)"
           R"(PARAMETER["Standard_Parallel_1",-71.0],UNIT["Meter",1.0]])",
       "EPSG:3031");
  // GDAL's form.
  same("PROJCS[\"WGS 84 / Pseudo-Mercator\"," + wgs84 +
           R"(,PROJECTION["Mercator_1SP"],PARAMETER["central_meridian",0],)"
           R"(PARAMETER["scale_factor",1],PARAMETER["false_easting",0],)"
           R"(PARAMETER["false_northing",0],UNIT["metre",1],AXIS["X",EAST],AXIS["Y",NORTH],)"
           R"(EXTENSION["PROJ4","+proj=merc +a=6378137 +b=6378137 +nadgrids=@null"],)"
           R"(AUTHORITY["EPSG","3857"]])",
       "EPSG:3857");
  same("PROJCS[\"NSIDC\"," + wgs84 +
           R"(,PROJECTION["Polar_Stereographic"],PARAMETER["latitude_of_origin",70],)"
           R"(PARAMETER["central_meridian",-45],PARAMETER["false_easting",0],)"
           R"(PARAMETER["false_northing",0],UNIT["metre",1],AXIS["Easting",SOUTH],)"
           R"(AXIS["Northing",SOUTH]])",
       "EPSG:3413");
}

TEST(CoordinateSystem, RejectsContradictoryWkt) {
  const std::string good = CoordinateSystem::parse("EPSG:32632").crs().wkt;
  EXPECT_NO_THROW(definition_of_contents(good));
  const auto broken = [&good](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  EXPECT_THROW(definition_of_contents(broken("0.9996", "0.9999")), ContradictoryCrs);
  EXPECT_THROW(definition_of_contents(broken("origin\",9,", "origin\",15,")), ContradictoryCrs);
  EXPECT_THROW(definition_of_contents(broken("298.257223563", "297")), ContradictoryCrs);
  EXPECT_THROW(definition_of_contents(broken("AXIS[\"(E)\",east", "AXIS[\"(W)\",west")), CrsError);
  EXPECT_THROW(definition_of_contents(broken("0.9996", "nan")), CrsError);
}

TEST(CoordinateSystem, ReadsAnySpellingInFiles) {
  const auto title = [](const std::string& text) {
    try {
      return definition_of_contents(text).title();
    } catch (const CrsError& error) {
      return std::string("refused: ") + error.what();
    }
  };
  for (const char* const text :
       {"EPSG:32632", "epsg:32632", "\xEF\xBB\xBF EPSG:32632\r\n", "urn:ogc:def:crs:EPSG::32632",
        "urn:x-ogc:def:crs:EPSG:6.9:32632", "http://www.opengis.net/def/crs/EPSG/0/32632",
        "https://opengis.net/def/crs/EPSG/0/32632", "+proj=utm +zone=32 +datum=WGS84",
        "+init=epsg:32632", "WGS 84 / UTM zone 32N"}) {
    EXPECT_EQ(title(text), "EPSG:32632 (WGS 84 / UTM zone 32N)") << text;
  }
  for (const char* const text : {"WGS84", "EPSGA:4326"}) {
    EXPECT_EQ(title(text), "EPSG:4326 (WGS 84)") << text;
  }
  EXPECT_EQ(title("WGS72"), "EPSG:4322 (WGS 72)");
  EXPECT_EQ(title("NAD83(HARN)"), "EPSG:4152 (NAD83(HARN))");
  for (const char* const text :
       {"CRS:84", "OGC:CRS84", "http://opengis.net/def/crs/OGC/1.3/CRS84"}) {
    EXPECT_EQ(title(text).find("refused"), std::string::npos) << text;
  }
  EXPECT_EQ(definition_of_contents("EPSG:25832+7837").vertical_epsg, 7837);
  EXPECT_EQ(title(" \n"), "refused: the definition is empty");
  // It must not lead to another file.
  const tests::TemporaryFolder folder;
  const std::string file = (folder.path() / "a.prj").string();
  std::ofstream(file) << "EPSG:32632";
  EXPECT_EQ(definition_of_text(file).epsg(), 32632);
  EXPECT_EQ(title(file).find("refused"), 0U);
  EXPECT_EQ(local_crs_of(crs_of_wkt(file)), std::nullopt);
}

TEST(CoordinateSystem, ReadsWktWithParentheses) {
  for (const std::string& brackets : {CoordinateSystem::parse("EPSG:32632").crs().wkt,
                                      CoordinateSystem::parse("EPSG:32632").crs_with_wkt1().wkt}) {
    std::string text = brackets;
    bool quoted = false;
    for (char& c : text) {
      if (c == '"') quoted = !quoted;
      if (!quoted && c == '[') c = '(';
      if (!quoted && c == ']') c = ')';
    }
    EXPECT_EQ(definition_of_contents(text).title(), definition_of_contents(brackets).title());
    EXPECT_EQ(definition_of_text(text).wkt, definition_of_contents(brackets).wkt);
  }
}

TEST(CoordinateSystem, RejectsExpensiveText) {
  const auto repeated = [](const std::string& text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += text;
    return all;
  };
  const auto refusal = [](const std::string& text) {
    try {
      definition_of_contents(text);
    } catch (const CrsError& error) {
      EXPECT_THROW(definition_of_text(text), CrsError);
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string nested =
      repeated("{\"type\":\"BoundCRS\",\"source_crs\":", 3200) + "1" + repeated("}", 3200);
  EXPECT_NE(refusal(nested).find("longer than 64 KiB"), std::string::npos);
  EXPECT_NE(refusal(nested.substr(0, 60000)).find("nested too deeply"), std::string::npos);
  EXPECT_NE(refusal(repeated("A[", 40)).find("nested too deeply"), std::string::npos);
  EXPECT_NE(refusal(repeated("A(\"", 40)), "");
  const std::string members = "{\"type\":\"GeographicCRS\",\"datum_ensemble\":{\"members\":[" +
                              repeated("{\"name\":\"a\"},", 3000) + "1]}}";
  EXPECT_NE(refusal(members).find("too many parts"), std::string::npos);
  // From every source of text: a file's WKT, ESRI's citation in GeoTIFF, the caller.
  stream::Crs crs;
  crs.wkt = members;
  EXPECT_THROW(definition_of(crs), CrsError);
  crs = {};
  crs.name = "ESRI PE String = " + members;
  EXPECT_THROW(definition_of(crs), CrsError);
  EXPECT_THROW(CoordinateSystem::parse(members), UsageError);
  // Brackets in quotes are text.
  EXPECT_EQ(refusal("{\"type\":\"" + repeated("[\\\"", 600)).find("parts"), std::string::npos);
}

constexpr char kOwnDatum[] =
    R"(PROJCS["own grid",GEOGCS["own",DATUM["own datum",SPHEROID["own",6377000,300]],)"
    R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],)"
    R"(PARAMETER["central_meridian",-2],PARAMETER["latitude_of_origin",49],)"
    R"(PARAMETER["scale_factor",1],PARAMETER["false_easting",400000],)"
    R"(PARAMETER["false_northing",-100000],UNIT["metre",1]])";

TEST(CoordinateSystem, UnknownDatumNeedsShift) {
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

// Ordnance Survey's seven parameters.
constexpr DatumShift kBritish{446.448, -125.157, 542.060, 0.1502, 0.2470, 0.8421, -20.4894};

TEST(CoordinateSystem, ShiftOverridesDatabase) {
  const CoordinateSystem bare = CoordinateSystem::parse("EPSG:27700");
  const CoordinateSystem shifted = CoordinateSystem::parse("EPSG:27700", kBritish);
  EXPECT_FALSE(bare.same_places(shifted));
  // The result of cs2cs of PROJ 9.1.1, with +towgs84.
  const Point2 place = shifted.to_geographic(Point2{530000, 180000});
  EXPECT_NEAR(place[0], -0.1285, 1e-3);
  EXPECT_NEAR(place[1], 51.5037, 1e-3);
  const Point2 back = shifted.from_geographic(place);
  EXPECT_NEAR(back[0], 530000, 0.01);  // heights between the ellipsoids are ignored
  EXPECT_NEAR(back[1], 180000, 0.01);
  // As a store records it.
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

TEST(CoordinateSystem, NamesOperationAndBetterAlternative) {
  const auto over = [](const char* text, double x, double y) {
    return CoordinateSystem::parse(text).over({{x, y, 0}, {x + 1000, y + 1000, 0}});
  };
  const CoordinateSystem etrs = over("EPSG:25832", 500000, 5200000);
  EXPECT_TRUE(etrs.counts_as_wgs84());
  EXPECT_EQ(etrs.to_wgs84().accuracy(), 1);
  EXPECT_EQ(CoordinateSystem().to_wgs84().accuracy(), 0);
  // The operation for all of Czechoslovakia is off by 6 m, the one for this place by 1 m.
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
TEST(CoordinateSystem, MatchesNationalGrids) {
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

TEST(CoordinateSystem, IsThreadSafe) {
  const CoordinateSystem shared =
      CoordinateSystem::parse("EPSG:5514").over({{-743000, -1044000, 0}, {-741000, -1042000, 0}});
  const CoordinateSystem alone =
      CoordinateSystem::parse("EPSG:5514").over({{-743000, -1044000, 0}, {-741000, -1042000, 0}});
  std::vector<Point2> expected;
  for (int i = 0; i < 1000; ++i)
    expected.push_back(alone.to_geographic(Point2{-742500.0 + i, -1043000}));
  std::array<int, 4> wrong{};
  {
    std::vector<std::jthread> threads;
    for (int& count : wrong) {
      threads.emplace_back([&shared, &expected, &count] {
        for (std::size_t i = 0; i < expected.size(); ++i) {
          const Point2 place =
              shared.to_geographic(Point2{-742500.0 + static_cast<double>(i), -1043000});
          count += place == expected[i] ? 0 : 1;
          if (i % 100 == 0)
            count += CoordinateSystem::parse("EPSG:28992").crs().epsg == 28992 ? 0 : 1;
        }
      });
    }
  }
  EXPECT_EQ(wrong, (std::array<int, 4>{}));
}

TEST(CoordinateSystem, HandlesPolesAndInvalidPlaces) {
  const auto forward = [](const char* crs, Point2 place) {
    return CoordinateSystem::parse(crs).from_geographic(place);
  };
  for (const char* crs : {"EPSG:3857", "EPSG:3395"}) {
    EXPECT_TRUE(std::isnan(forward("EPSG:3857", {0, 90})[0])) << crs;
  }
  EXPECT_TRUE(std::isnan(forward("EPSG:32632", {9, 90.5})[0]));
  EXPECT_TRUE(std::isnan(forward("EPSG:32632", {NAN, 0})[0]));
  EXPECT_NEAR(forward("EPSG:3413", {123, 90})[0], 0, 1e-6);
  EXPECT_NEAR(forward("EPSG:32661", {0, 90})[1], 2000000, 1e-6);
  EXPECT_TRUE(std::isnan(forward("EPSG:3413", {0, -90})[0]));
  // Longitudes beyond the antimeridian are the same place.
  const Point2 east = forward("EPSG:32660", {181, 10}), west = forward("EPSG:32660", {-179, 10});
  EXPECT_NEAR(east[0], west[0], 1e-8);
  EXPECT_LT(CoordinateSystem::parse("EPSG:32660").to_geographic(east)[0], -178.99);
  const Point2 outside = CoordinateSystem::parse("EPSG:3035").to_geographic(Point2{3e7, 0});
  EXPECT_TRUE(std::isnan(outside[0]));
}

std::vector<std::vector<double>> rows_of(const std::string& name) {
  const char* const data = std::getenv("TERRACE_DATA");
  std::vector<std::vector<double>> rows;
  if (data == nullptr) return rows;
  std::ifstream file(std::string(data) + "/geodesy/" + name);
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    if (line.starts_with('#')) continue;
    std::vector<double> row;
    for (double value = 0; words >> value;) row.push_back(value);
    rows.push_back(row);
  }
  return rows;
}

// GeographicLib's exact projection (elliptic functions), in metres without a false origin.
TEST(CoordinateSystem, MatchesExactTransverseMercator) {
  const auto rows = rows_of("utm_tm_exact_2000.tsv");
  if (rows.empty()) GTEST_SKIP() << "TERRACE_DATA is not set";
  ASSERT_EQ(rows.size(), 2000u);
  double worst = 0;
  for (const auto& row : rows) {
    const int zone = static_cast<int>(row[0]);
    const CoordinateSystem utm(definition_of_epsg((row[1] < 0 ? 32700 : 32600) + zone));
    const Point2 plane = utm.from_geographic(Point2{row[2], row[1]});
    const double north = row[1] < 0 ? 1e7 : 0;
    worst =
        std::max({worst, std::abs(plane[0] - 5e5 - row[3]), std::abs(plane[1] - north - row[4])});
  }
  EXPECT_LT(worst, 1e-8);
}

stream::Crs keys(std::vector<stream::GeoKey> list) {
  stream::Crs crs;
  crs.name = "own grid";
  crs.geo_keys = std::move(list);
  for (const stream::GeoKey& key : crs.geo_keys) {
    if (key.key == 3072 && key.values[0] < 32767) crs.epsg = static_cast<int>(key.values[0]);
    if (key.key == 1024) crs.geographic = key.values[0] == 2;
  }
  if (crs.epsg == 0 && crs.geographic) crs.epsg = 4326;
  return crs;
}

TEST(GeoKeys, ReadUserDefinedProjections) {
  const auto same = [](std::vector<stream::GeoKey> list, const char* code) {
    const auto system = CoordinateSystem::of(keys(std::move(list)), "file");
    ASSERT_TRUE(system);
    EXPECT_TRUE(system->same_places(CoordinateSystem::parse(code))) << code;
  };
  same({{1024, {1}, ""},
        {2048, {4326}, ""},
        {3072, {32767}, ""},
        {3074, {32767}, ""},
        {3075, {1}, ""},
        {3076, {9001}, ""},
        {3080, {9}, ""},
        {3081, {0}, ""},
        {3082, {500000}, ""},
        {3083, {0}, ""},
        {3092, {0.9996}, ""}},
       "EPSG:32632");
  same({{1024, {1}, ""},
        {2048, {4258}, ""},
        {3072, {32767}, ""},
        {3075, {10}, ""},
        {3076, {9001}, ""},
        {3082, {4321000}, ""},
        {3083, {3210000}, ""},
        {3088, {10}, ""},
        {3089, {52}, ""}},
       "EPSG:3035");
  same({{1024, {1}, ""},
        {2048, {4269}, ""},
        {3072, {32767}, ""},
        {3075, {11}, ""},
        {3076, {9001}, ""},
        {3078, {29.5}, ""},
        {3079, {45.5}, ""},
        {3080, {-96}, ""},
        {3081, {23}, ""},
        {3082, {0}, ""},
        {3083, {0}, ""}},
       "EPSG:5070");
  same({{1024, {1}, ""},
        {2048, {4326}, ""},
        {3072, {32767}, ""},
        {3075, {15}, ""},
        {3076, {9001}, ""},
        {3081, {-71}, ""},
        {3092, {1}, ""},
        {3095, {0}, ""}},
       "EPSG:3031");
  same({{1024, {1}, ""},
        {2048, {4326}, ""},
        {3072, {32767}, ""},
        {3074, {16032}, ""},
        {3076, {9001}, ""}},
       "EPSG:32632");
  // The false easting is in feet, like the unit.
  same({{1024, {1}, ""},
        {2048, {4269}, ""},
        {3072, {32767}, ""},
        {3075, {8}, ""},
        {3076, {9003}, ""},
        {3078, {41 + 2.0 / 60}, ""},
        {3079, {40 + 40.0 / 60}, ""},
        {3084, {-74}, ""},
        {3085, {40 + 10.0 / 60}, ""},
        {3086, {984250}, ""},
        {3087, {0}, ""}},
       "EPSG:2263");
}

TEST(GeoKeys, UseDatumCodeThatMatchesEllipsoid) {
  const auto with = [](double inverse_flattening) {
    return keys({{1024, {1}, ""},
                 {2048, {32767}, ""},
                 {2049, {}, "GCS Name = GCS_North_American_1983_HARN|Primem = Greenwich||"},
                 {2050, {6152}, ""},
                 {2054, {9102}, ""},
                 {2057, {6378137}, ""},
                 {2059, {inverse_flattening}, ""},
                 {2061, {0}, ""},
                 {3072, {32767}, ""},
                 {3074, {32767}, ""},
                 {3075, {8}, ""},
                 {3076, {9002}, ""},
                 {3078, {43}, ""},
                 {3079, {45.5}, ""},
                 {3084, {-120.5}, ""},
                 {3085, {41.75}, ""},
                 {3086, {1312335.958005249}, ""},
                 {3087, {0}, ""}});
  };
  const auto system = CoordinateSystem::of(with(298.257222101), "file");
  ASSERT_TRUE(system);
  EXPECT_TRUE(system->same_places(CoordinateSystem::parse("EPSG:2994"))) << system->title();
  EXPECT_TRUE(system->reaches_wgs84());
  // The ellipsoid of another datum.
  EXPECT_FALSE(CoordinateSystem::of(with(294.978698214), "file")->reaches_wgs84());
}

TEST(GeoKeys, RejectAndNameContradictions) {
  const std::vector<std::vector<stream::GeoKey>> lists{
      {{1024, {1}, ""}, {3072, {32632}, ""}, {3076, {9002}, ""}},
      {{1024, {1}, ""}, {2048, {4269}, ""}, {3072, {32632}, ""}},
      {{1024, {1}, ""}, {3072, {32632}, ""}, {3092, {0.9999}, ""}},
      {{1024, {1}, ""}, {3072, {32632}, ""}, {3080, {15}, ""}},
      {{1024, {2}, ""}, {3072, {32632}, ""}},
  };
  for (const auto& list : lists) {
    try {
      CoordinateSystem::of(keys(list), "dem.tif");
      ADD_FAILURE() << "accepted";
    } catch (const stream::Error& error) {
      const std::string what = error.what();
      EXPECT_NE(what.find("contradict"), std::string::npos) << what;
      EXPECT_NE(what.find("dem.tif"), std::string::npos) << what;
      EXPECT_NE(what.find("`crs`"), std::string::npos) << what;
    }
  }
  EXPECT_TRUE(CoordinateSystem::of(keys({{1024, {1}, ""},
                                         {2048, {4326}, ""},
                                         {3072, {32632}, ""},
                                         {3076, {9001}, ""},
                                         {3092, {0.9996}, ""}}),
                                   "dem.tif"));
}

TEST(GeoKeys, RequireGeographicBase) {
  for (const double base : {4978.0, 4389.0, 32632.0, 5703.0}) {  // geocentric, projected, heights
    const stream::Crs crs = keys({{1024, {1}, ""},
                                  {2048, {base}, ""},
                                  {3072, {32767}, ""},
                                  {3074, {32767}, ""},
                                  {3075, {8}, ""},
                                  {3076, {9001}, ""},
                                  {3078, {49}, ""},
                                  {3079, {46}, ""},
                                  {3084, {13.3}, ""},
                                  {3085, {47.5}, ""},
                                  {3086, {400000}, ""},
                                  {3087, {400000}, ""}});
    EXPECT_THROW(CoordinateSystem::of(crs, "file"), stream::Error) << base;
  }
}

/// GDAL writes both without a GeoTIFF model.
TEST(GeoKeys, ReadEsriDefinitionsAndIgnoreLocalSystems) {
  stream::Crs crs;
  crs.geo_keys = {{1024, {32767}, ""}, {2048, {4326}, ""}, {3076, {9001}, ""}};
  crs.name =
      "ESRI PE String = PROJCS[\"unknown\",GEOGCS[\"GCS_unknown\",DATUM[\"D_WGS_1984\","
      "SPHEROID[\"WGS_1984\",6378137.0,298.257223563]],PRIMEM[\"Greenwich\",0.0],"
      "UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\"Mollweide\"],"
      "PARAMETER[\"False_Easting\",0.0],PARAMETER[\"False_Northing\",0.0],"
      "PARAMETER[\"Central_Meridian\",0.0],UNIT[\"Meter\",1.0]]";
  const auto system = CoordinateSystem::of(crs, "dem.tif");
  ASSERT_TRUE(system);
  EXPECT_FALSE(system->definition().geographic);
  EXPECT_NEAR(system->from_geographic({10, 0})[0], 1002227.54, 0.01);

  crs.geo_keys = {{3076, {9003}, ""}};
  crs.name = "site";
  EXPECT_FALSE(CoordinateSystem::of(crs, "dem.tif"));
}

TEST(GeoKeys, UseProjForMethodsWithoutEpsgCode) {
  const std::vector<std::pair<int, std::string>> methods{
      {12, "aeqd +lat_0=46"},  {13, "eqdc +lat_0=46 +lat_1=40 +lat_2=50"},
      {14, "stere +lat_0=46"}, {17, "eqc +lat_ts=40"},
      {19, "gnom +lat_0=46"},  {20, "mill +R_A"},
      {21, "ortho +lat_0=46"}, {22, "poly +lat_0=46"},
      {23, "robin"},           {24, "sinu"},
      {25, "vandg +R_A"},      {28, "cea +lat_ts=40"}};
  for (const auto& [number, text] : methods) {
    SCOPED_TRACE(text);
    stream::Crs crs = keys({{1024, {1}, ""},
                            {2048, {4326}, ""},
                            {3072, {32767}, ""},
                            {3074, {32767}, ""},
                            {3075, {static_cast<double>(number)}, ""},
                            {3076, {9001}, ""},
                            {3082, {1000}, ""},
                            {3083, {-2000}, ""},
                            {3088, {8}, ""}});
    const auto number_behind = [&text = text](const std::string& name) {
      const std::size_t at = text.find("+" + name + "=");
      return at == text.npos ? std::nullopt
                             : std::optional(std::stod(text.substr(at + name.size() + 2)));
    };
    const auto add = [&](int key, const std::string& name) {
      if (const auto value = number_behind(name)) {
        crs.geo_keys.push_back({static_cast<std::uint16_t>(key), {*value}, ""});
      }
    };
    add(3089, "lat_0");
    add(3078, "lat_ts");
    add(3078, "lat_1");
    add(3079, "lat_2");
    crs.epsg = 0;
    const auto system = CoordinateSystem::of(crs, "dem.tif");
    ASSERT_TRUE(system);
    const ProjObject pipeline(proj_create(
        proj_context(), ("+proj=" + text + " +lon_0=8 +x_0=1000 +y_0=-2000 +ellps=WGS84").c_str()));
    ASSERT_NE(pipeline, nullptr);
    const PJ_COORD expected =
        proj_trans(pipeline.get(), PJ_FWD, proj_coord(proj_torad(9.5), proj_torad(44), 0, 0));
    const Point2 place = system->from_geographic({9.5, 44});
    EXPECT_NEAR(place[0], expected.xy.x, 1e-6);
    EXPECT_NEAR(place[1], expected.xy.y, 1e-6);
  }
}

TEST(GeoKeys, RejectCodesBeyond16Bits) {
  for (const double code : {4326.5, -4326.0, 1e300}) {
    stream::Crs crs;
    crs.geo_keys = {{1024, {2}, ""}, {2048, {code}, ""}};
    try {
      CoordinateSystem::of(crs, "dem.tif");
      ADD_FAILURE() << code << " is accepted";
    } catch (const stream::Error& error) {
      EXPECT_NE(std::string(error.what()).find("GeoKey 2048"), std::string::npos) << error.what();
    }
  }
}

TEST(GeoKeys, RejectImpossibleNumbers) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::vector<stream::GeoKey>> lists{
      {{1024, {2}, ""}, {2048, {32767}, ""}, {2057, {-1}, ""}, {2059, {300}, ""}},
      {{1024, {2}, ""}, {2048, {32767}, ""}, {2057, {6.4e6}, ""}, {2059, {1}, ""}},
      {{1024, {2}, ""}, {2048, {32767}, ""}, {2056, {7004}, ""}, {2062, {1, 2, nan}, ""}},
      {{1024, {2}, ""},
       {2048, {32767}, ""},
       {2057, {-1}, ""},
       {2059, {300}, ""},
       {2062, {1, 2, 3}, ""}},
  };
  for (const auto& list : lists) {
    stream::Crs crs;
    crs.geo_keys = list;
    EXPECT_THROW(CoordinateSystem::of(crs, "dem.tif"), stream::Error);
  }
}

/// The stored record of such a system was once refused on reading, because it contradicted the code
/// derived from its name.
TEST(Wkt, DatumNameNeedsMatchingEllipsoid) {
  stream::Crs crs;
  crs.wkt =
      "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"Bessel\",6377397.155,299.1528128]],"
      "UNIT[\"degree\",0.0174532925199433]]";
  const auto system = CoordinateSystem::of(crs, "dem.tif");
  ASSERT_TRUE(system);
  EXPECT_EQ(system->definition().epsg(), 0);
  EXPECT_FALSE(system->reaches_wgs84());
  const auto kept = CoordinateSystem::of(system->crs(), "dem.store");
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->definition().ellipsoid, system->definition().ellipsoid);
}

TEST(Wkt, RejectsUnitsWithoutSize) {
  for (const char* const unit : {"0", "-1"}) {
    stream::Crs crs;
    crs.wkt = std::string("GEOGCS[\"x\",DATUM[\"y\",SPHEROID[\"z\",6378137,298]],UNIT[\"u\",") +
              unit + "]]";
    EXPECT_THROW(CoordinateSystem::of(crs, "dem.tif"), stream::Error) << unit;
  }
}

TEST(GeoKeys, NameMissingKeys) {
  const std::vector<std::vector<stream::GeoKey>> lists{
      {{1024, {1}, ""}, {3072, {32767}, ""}, {3075, {1}, ""}, {3076, {9001}, ""}},  // no datum
      {{1024, {1}, ""}, {2048, {4326}, ""}, {3072, {32767}, ""}, {3075, {1}, ""}},  // no unit
      {{1024, {1}, ""}, {2048, {4326}, ""}, {3072, {32767}, ""}, {3076, {9001}, ""}},
      {{1024, {1}, ""},
       {2048, {4326}, ""},
       {3072, {32767}, ""},
       {3075, {2}, ""},
       {3076, {9001}, ""}},
      {{1024, {1}, ""},
       {2048, {4326}, ""},
       {3072, {32767}, ""},
       {3075, {1}, ""},
       {3076, {9001}, ""},
       {3092, {NAN}, ""}},
  };
  for (const auto& list : lists) EXPECT_THROW(CoordinateSystem::of(keys(list), "f"), stream::Error);
  EXPECT_FALSE(CoordinateSystem::of(stream::Crs{}, "f"));
}

TEST(DatumShift, NeedsThreeOrSevenNumbers) {
  EXPECT_EQ(parse_datum_shift("1,2,3"), (DatumShift{1, 2, 3}));
  EXPECT_EQ(parse_datum_shift("1,2,3,4,5,6,7"), (DatumShift{1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(parse_datum_shift(""), std::nullopt);
  for (const char* text : {"1", "1,2", "1,2,3,4", "a,b,c", "1,2,3,4,5,6,7,8"}) {
    EXPECT_THROW(parse_datum_shift(text), UsageError) << text;
  }
}

TEST(PlaceConversion, HearsAStop) {
  struct Stop {};
  const PlaceConversion places(
      Transformation(CoordinateSystem::parse("EPSG:32632"), CoordinateSystem::parse("EPSG:4326")));
  std::vector<stream::Point3> points(20000, stream::Point3{500000, 5000000, 7});
  std::size_t calls = 0;
  EXPECT_THROW(places(points,
                      [&] {
                        if (++calls == 10) throw Stop();
                      }),
               Stop);
  EXPECT_EQ(calls, 10U);
  EXPECT_EQ(points.back(), (stream::Point3{500000, 5000000, 7}));
}

}  // namespace
}  // namespace terrace::terrain
