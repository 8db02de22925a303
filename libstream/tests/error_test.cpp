// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/error.hpp"

#include <cerrno>

#include <gtest/gtest.h>

namespace terrace::stream {
namespace {

TEST(Error, NamesFilePlaceCauseAndRemedyInThisOrder) {
  const Error error = Error("a.xyz", "is not a point").at_line(12).remedy("correct it");
  EXPECT_STREQ(error.what(), "a.xyz: line 12: is not a point; correct it");
  EXPECT_EQ(error.parts().file, "a.xyz");
  EXPECT_EQ(error.parts().where, "line 12");
  EXPECT_EQ(error.parts().cause.text(), "is not a point");
  EXPECT_EQ(error.parts().remedy.text(), "correct it");
}

TEST(Error, LeavesOutPartsThatAreNotGiven) {
  EXPECT_STREQ(Error("a.xyz", "is empty").what(), "a.xyz: is empty");
  EXPECT_STREQ(Error({}, "is empty").what(), "is empty");
  EXPECT_STREQ(Error({}, "is empty").at("tile 3,4").what(), "tile 3,4: is empty");
}

TEST(Error, TakesTheLastOfEachPart) {
  const Error error = Error("a.las", "is truncated")
                          .at("header")
                          .remedy("export it")
                          .at_byte(7)
                          .remedy("restore it");
  EXPECT_STREQ(error.what(), "a.las: byte 7: is truncated; restore it");
}

TEST(Error, KeepsTheNumberOfAFailedSystemCall) {
  EXPECT_EQ(Error("a", "exists").parts().error_number, 0);
  EXPECT_EQ(Error("a", "exists").error_number(EEXIST).remedy("move it").parts().error_number,
            EEXIST);
  const Error error = system_error("a", "cannot open", ENOENT, "check the name");
  EXPECT_STREQ(error.what(), "a: cannot open: No such file or directory; check the name");
  EXPECT_EQ(error.parts().error_number, ENOENT);
}

TEST(Error, IsOneLineWhateverItsPartsContain) {
  EXPECT_STREQ(Error("a\nb", "c\r\nd").what(), "a b: c  d");
}

TEST(Error, CarriesNamesOfParametersAsData) {
  const Error error = Error("`level`", message("has no {level} {}", 3)).remedy("{level}");
  EXPECT_STREQ(error.what(), "`level`: has no `level` 3; {level}");
  EXPECT_EQ(error.message().text([](std::string_view name) { return "--" + std::string(name); }),
            "`level`: has no --level 3; {level}");
}

TEST(Message, PutsValuesIntoThePattern) {
  const Message inner = message("{zoom} {}", "{}");
  EXPECT_EQ(message("{}, {}: {}; {level}", std::string("a"), -5, inner).text(),
            "a, -5: `zoom` {}; `level`");
  EXPECT_EQ(message("no fields").text(), "no fields");
  EXPECT_EQ((inner + " and " + message("{level}")).text(), "`zoom` {} and `level`");
  EXPECT_TRUE(Message("").empty());
  EXPECT_TRUE(Message().empty());
  EXPECT_FALSE(message("{level}").empty());
}

}  // namespace
}  // namespace terrace::stream
