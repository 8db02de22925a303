// SPDX-License-Identifier: Apache-2.0
#include "sample/place_file.hpp"

#include <gtest/gtest.h>

#include "terrace/stream/error.hpp"

namespace terrace::terrain {
namespace {

TEST(PlaceFile, NestedQuotesUseNoStack) {
  const std::string quotes(std::size_t{1} << 20, '"');
  PlaceLayout layout;
  layout.separator = ';';
  const Point2 place = place_of(quotes + ";1", layout, "places.csv", 1);
  EXPECT_TRUE(place[0] != place[0]);  // the quotes are empty
  EXPECT_EQ(place[1], 1.0);
  EXPECT_TRUE(PlaceLayout::of(quotes + "x" + quotes + ",y", "places.csv").header);
}

TEST(PlaceFile, FindsPlaceColumnsByName) {
  for (const std::string_view header :
       {"id,POINT_X,POINT_Y", "id,x_coord,y_coord", "PointID;Easting(m);Northing(m)", "n_id,E,N",
        "id,x,y,lon,lat", "name,lon,lat,easting,northing"}) {
    const PlaceLayout layout = PlaceLayout::of(header, "places.csv");
    EXPECT_TRUE(layout.header) << header;
    EXPECT_EQ(layout.x, 1u) << header;
    EXPECT_EQ(layout.y, 2u) << header;
  }
  const PlaceLayout commented = PlaceLayout::of("7,1,2", "places.csv", "# id,x,y");
  EXPECT_FALSE(commented.header);
  EXPECT_EQ(commented.x, 1u);
  EXPECT_EQ(PlaceLayout::of("1,2", "places.csv", "# id,x,y").x, 0u);
  EXPECT_EQ(PlaceLayout::of("5,", "places.csv").x, 0u);
  EXPECT_THROW(PlaceLayout::of("id,first,second", "places.csv"), stream::Error);
}

TEST(PlaceFile, RejectsDecimalCommas) {
  const auto refusal = [](const auto& work) -> std::string {
    try {
      work();
    } catch (const stream::Error& error) {
      return error.what();
    }
    return {};
  };
  for (const char* line : {"1,5\t2,5", "1,5;2,5;here", "1;2,5"}) {
    const std::string error = refusal([&] { PlaceLayout::of(line, "places.csv"); });
    EXPECT_NE(error.find("decimal point"), std::string::npos) << line << ": " << error;
  }
  const PlaceLayout tabs = PlaceLayout::of("x\ty", "places.csv");
  const std::string error = refusal([&] { place_of("1,5\t2,5", tabs, "places.csv", 2); });
  EXPECT_NE(error.find("decimal point"), std::string::npos) << error;
  EXPECT_EQ(PlaceLayout::of("1,5,a;b", "places.csv").separator, ',');
}

}  // namespace
}  // namespace terrace::terrain
