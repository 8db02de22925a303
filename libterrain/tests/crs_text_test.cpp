// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "earth/crs/datum_change.hpp"
#include "earth/crs/definition.hpp"
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

TEST(CrsText, KnowsUnitsOfCodes) {
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

TEST(CrsText, RejectsInvalidText) {
  for (const char* text : {"", "32632", "EPSG:", "EPSG:x", "EPSG:12", "EPSG:99999", "EPSG:4326 ",
                           "EPSG:4326+", "EPSG:4326+4326", "EPSG:5703", "no/such/file.prj",
                           "PROJCS[\"x\"", "GEOGCS[\"x\"]", "LOCAL_CS[\"x\",UNIT[\"metre\",1]]",
                           "[]", "GEOGCS[[[[", "(((((((((((((((((((((((((((((((((((((((((("}) {
    EXPECT_THROW(CoordinateSystem::parse(text), UsageError) << text;
  }
}

TEST(CrsText, ReadsOldArcInfoFiles) {
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

TEST(CrsText, ReadsCommonSpellings) {
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
TEST(CrsText, ReadsBackRecordsOfFiles) {
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
  // Records have WKT 1 if it can express the system.
  EXPECT_TRUE(CoordinateSystem::parse("EPSG:32632").crs_with_wkt1().wkt.starts_with("PROJCS["));
}

/// One system in the spellings of different files.
TEST(CrsText, RecognisesEqualDescriptions) {
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

TEST(CrsText, NamesGeocentricSystems) {
  const stream::Crs crs = crs_named("EPSG:4978");
  EXPECT_EQ(crs.epsg, 0);
  EXPECT_EQ(crs.horizontal_unit, "metre");
  EXPECT_EQ(crs.vertical_unit, "metre");
  EXPECT_TRUE(crs.wkt.starts_with("GEODCRS[")) << crs.wkt;
  EXPECT_FALSE(CoordinateSystem::of(crs, "store"));
  EXPECT_FALSE(CoordinateSystem::of(crs_of_code(4978), "file"));
  EXPECT_THROW(CoordinateSystem::parse("EPSG:4978"), UsageError);
}

TEST(CrsText, ReadsHeightReferenceOfCodes) {
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

TEST(CrsText, ReadsOtherWktDialects) {
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

TEST(CrsText, RejectsContradictoryWkt) {
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

TEST(CrsText, ReadsAnySpellingInFiles) {
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
  // The text in a file must not name another file.
  const tests::TemporaryFolder folder;
  const std::string file = (folder.path() / "a.prj").string();
  std::ofstream(file) << "EPSG:32632";
  EXPECT_EQ(on_earth(crs_of_text(file)).epsg(), 32632);
  EXPECT_EQ(title(file).find("refused"), 0U);
  EXPECT_THROW(local_crs_of(crs_of_wkt(file)), CrsError);
}

TEST(CrsText, ReadsWktWithParentheses) {
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
    EXPECT_EQ(on_earth(crs_of_text(text)).wkt, definition_of_contents(brackets).wkt);
  }
}

TEST(CrsText, RejectsExpensiveText) {
  const auto repeated = [](const std::string& text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += text;
    return all;
  };
  const auto refusal = [](const std::string& text) {
    try {
      definition_of_contents(text);
    } catch (const CrsError& error) {
      EXPECT_THROW(on_earth(crs_of_text(text)), CrsError);
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
  // Test every source of text: the WKT of a file, ESRI's citation in GeoTIFF, and the caller.
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

/// The stored record of such a system was once refused on reading, because it contradicted the code
/// derived from its name.
TEST(CrsText, DatumNameNeedsMatchingEllipsoid) {
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

TEST(CrsText, RejectsUnitsWithoutSize) {
  for (const char* const unit : {"0", "-1"}) {
    stream::Crs crs;
    crs.wkt = std::string("GEOGCS[\"x\",DATUM[\"y\",SPHEROID[\"z\",6378137,298]],UNIT[\"u\",") +
              unit + "]]";
    EXPECT_THROW(CoordinateSystem::of(crs, "dem.tif"), stream::Error) << unit;
  }
}

}  // namespace
}  // namespace terrace::terrain
