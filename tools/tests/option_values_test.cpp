// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/option_values.hpp"

#include <gtest/gtest.h>

#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

TEST(Focus, ParsesBoxAndLevel) {
  const Focus focus = parse_focus("-1,-1,1,1:3");
  EXPECT_EQ(focus.level, 3u);
  EXPECT_EQ(focus.region.box().max[0], 1);
  EXPECT_FALSE(parse_focus("0,0,1,1:top").level.has_value());
  for (const char* text : {"0,0,1,1", "0,0,1,1:", "0,0,1,1:x", "0,0,1,1:-1", "0,0,1,1:999"}) {
    EXPECT_THROW(parse_focus(text), UsageError) << text;
  }
}

}  // namespace
}  // namespace terrace::tools
