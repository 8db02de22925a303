// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/option_names.hpp"

#include <gtest/gtest.h>

namespace terrace::tools {
namespace {

TEST(OptionNames, ReplacesParametersByOptions) {
  EXPECT_EQ(with_option_names("raise `memory_bytes`, lower `block_points`"),
            "raise --memory, lower --block");
  EXPECT_EQ(with_option_names("`max_edge` is for points"), "--max-edge is for points");
  EXPECT_EQ(with_option_names("give `replace`"), "give --force");
}

TEST(OptionNames, KeepsOtherText) {
  for (const char* text : {"", "a", "`", "``", "`level", "level`", "`terrace info` shows",
                           "a file named `x", "`levels`", "``level", "` level`"}) {
    EXPECT_EQ(with_option_names(text), text);
  }
  EXPECT_EQ(with_option_names("`terrace info`: `level`"), "`terrace info`: --level");
  EXPECT_EQ(with_option_names("a`b`level`c"), "a`b--levelc");
}

}  // namespace
}  // namespace terrace::tools
