// SPDX-License-Identifier: GPL-3.0-or-later
#include "src/crs_option.hpp"

#include <gtest/gtest.h>

#include "src/error.hpp"

namespace terrace::tools {
namespace {

TEST(ParseCrs, KnowsWhatTheCodesMeasureIn) {
  for (const char* code : {"EPSG:4326", "epsg:4258", "EPSG:4269", "EPSG:4979"}) {
    EXPECT_TRUE(parse_crs(code).geographic) << code;
    EXPECT_EQ(parse_crs(code).horizontal_unit, "degree");
  }
  for (const char* code : {"EPSG:32632", "EPSG:25833", "EPSG:3857", "EPSG:2056", "EPSG:4087"}) {
    EXPECT_FALSE(parse_crs(code).geographic) << code;
    EXPECT_EQ(parse_crs(code).horizontal_unit, "metre") << code;
  }
  EXPECT_EQ(parse_crs("EPSG:2263").horizontal_unit, "US survey foot");
  EXPECT_EQ(parse_crs("EPSG:32632").epsg, 32632);
}

TEST(ParseCrs, RefusesOtherText) {
  for (const char* text : {"", "32632", "EPSG:", "EPSG:x", "EPSG:12", "EPSG:99999", "EPSG:4326 "}) {
    EXPECT_THROW(parse_crs(text), UsageError) << text;
  }
}

}  // namespace
}  // namespace terrace::tools
