// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal.hpp"

#include <string>

#include <gtest/gtest.h>

namespace terrace::tools {
namespace {

TEST(Terminal, KeepsPrintableText) {
  for (const std::string text :
       {"", "plain, 12 % ~", "a\nb\n", "Großglockner", "富士山", "🏔", "\\x"}) {
    EXPECT_EQ(printable(text), text);
  }
}

TEST(Terminal, EscapesControlCharacters) {
  EXPECT_EQ(printable("\x1b[31m"), "\\x1b[31m");
  EXPECT_EQ(printable("a\rb\tc\bd\x7f"), "a\\x0db\\tc\\x08d\\x7f");
  EXPECT_EQ(printable(std::string("\0", 1)), "\\x00");
  EXPECT_EQ(printable("\u009b2J"), "\\xc2\\x9b2J") << "a control sequence in one character";
  EXPECT_EQ(printable("\u202egpj.exe"), "\\xe2\\x80\\xaegpj.exe") << "right to left";
  EXPECT_EQ(printable_line("a\nb"), "a\\nb");
}

TEST(Terminal, EscapesInvalidUtf8) {
  EXPECT_EQ(printable("caf\xe9"), "caf\\xe9");
  EXPECT_EQ(printable("\x9b"
                      "1m"),
            "\\x9b1m");
  EXPECT_EQ(printable("\xc0\x9b"), "\\xc0\\x9b") << "overlong encoding";
  EXPECT_EQ(printable("\xe0\x82\x9b"), "\\xe0\\x82\\x9b") << "overlong encoding";
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "lone surrogate";
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "beyond U+10FFFF";
  EXPECT_EQ(printable("x\xe5\xaf"), "x\\xe5\\xaf") << "cut short";
}

}  // namespace
}  // namespace terrace::tools
