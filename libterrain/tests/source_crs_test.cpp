// SPDX-License-Identifier: Apache-2.0
#include "earth/source_crs.hpp"

#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "earth/crs/crs_definition.hpp"
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

}  // namespace
}  // namespace terrace::terrain
