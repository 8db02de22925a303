// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/option_names.hpp"

#include <gtest/gtest.h>

namespace terrace::tools {
namespace {

using stream::message;

TEST(OptionNames, ShowsParametersAsOptions) {
  EXPECT_EQ(option_text(message("raise {memory_bytes}, lower {block_points}")),
            "raise --memory, lower --block");
  EXPECT_EQ(option_text(message("{max_edge} is for points")), "--max-edge is for points");
  EXPECT_EQ(option_text(message("give {replace}")), "give --force");
}

TEST(OptionNames, KeepsTextThatLooksLikeAParameter) {
  for (const char* text : {"", "a", "`level`", "{level}", "`terrace info` shows", "a{}b"}) {
    EXPECT_EQ(option_text(text), text);
    EXPECT_EQ(option_text(message("{}: {level}", text)), text + std::string(": --level"));
  }
}

}  // namespace
}  // namespace terrace::tools
