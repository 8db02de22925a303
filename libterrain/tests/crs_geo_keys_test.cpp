// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "earth/crs/definition.hpp"
#include "earth/crs/proj_object.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {
namespace {

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
  // This is the ellipsoid of another datum.
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

}  // namespace
}  // namespace terrace::terrain
