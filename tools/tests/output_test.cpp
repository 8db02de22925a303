// SPDX-License-Identifier: GPL-3.0-or-later
#include "src/output.hpp"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "terrace/stream/error.hpp"

namespace terrace::tools {
namespace {

class MayReplace : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  void write(const std::string& text) const { std::ofstream(path_, std::ios::binary) << text; }

  std::string path_ = ::testing::TempDir() + "terrace_output_test";
};

TEST_F(MayReplace, NothingIsThere) { EXPECT_FALSE(may_replace(path_, false)); }

TEST_F(MayReplace, RefusesAnExistingFileWithoutForce) {
  write("1 2 3\n");
  EXPECT_THROW(may_replace(path_, false), stream::Error);
  EXPECT_TRUE(may_replace(path_, true));
}

TEST_F(MayReplace, ForceTakesMarkedFilesAndNumberTablesOnly) {
  for (const char* ours : {"", "ply\nformat ascii 1.0\ncomment written by terrace\n",
                           "x,y,z\n1,2,3\n", "1.5 2e3 nan\n-4 5 6"}) {
    write(ours);
    EXPECT_TRUE(may_replace(path_, true)) << ours;
  }
  write(std::string(200000, '\xFF') + "terrace");
  EXPECT_TRUE(may_replace(path_, true));
  for (const char* foreign : {"ply\nformat ascii 1.0\n", "#!/bin/sh\necho 1\n",
                              "\x7F"
                              "ELF",
                              "Dear diary,\ntoday 1 2 3\n", "Dear friend, no points here.\n"}) {
    write(foreign);
    EXPECT_THROW(may_replace(path_, true), stream::Error) << foreign;
  }
}

TEST_F(MayReplace, NeverAFolder) {
  EXPECT_THROW(may_replace(::testing::TempDir(), true), stream::Error);
}

}  // namespace
}  // namespace terrace::tools
