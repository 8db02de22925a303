// SPDX-License-Identifier: Apache-2.0
#include "sample/place_file.hpp"

#include <gtest/gtest.h>

namespace terrace::terrain {
namespace {

TEST(PlaceFile, QuotesAroundQuotesTakeNoStack) {
  const std::string quotes(std::size_t{1} << 20, '"');
  PlaceLayout layout;
  layout.separator = ';';
  const Point2 place = place_of(quotes + ";1", layout, "places.csv", 1);
  EXPECT_TRUE(place[0] != place[0]);  // nothing is in the quotes
  EXPECT_EQ(place[1], 1.0);
  EXPECT_TRUE(PlaceLayout::of(quotes + "x" + quotes + ",y", "places.csv").header);
}

}  // namespace
}  // namespace terrace::terrain
