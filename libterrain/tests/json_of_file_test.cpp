// SPDX-License-Identifier: Apache-2.0
#include "base/json_of_file.hpp"

#include <fstream>
#include <stop_token>
#include <string>

#include <gtest/gtest.h>

#include "temporary_folder.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::terrain {
namespace {

class JsonOfFile : public ::testing::Test {
 protected:
  /// Returns the error for a file with this text, of at most 64 KiB.
  std::string fault_of(const std::string& text) const {
    std::ofstream(path_, std::ios::binary) << text;
    try {
      static_cast<void>(json_of_file(path_, std::uint64_t{64} << 10, "convert it"));
    } catch (const stream::Error& error) {
      EXPECT_EQ(error.parts().remedy.text(), "convert it");
      return error.parts().where + (error.parts().where.empty() ? "" : ": ") +
             error.parts().cause.text();
    }
    return "none";
  }

  tests::TemporaryFolder scratch_;
  std::string path_ = scratch_.path() / "file.json";
};

TEST_F(JsonOfFile, ReadsJson) {
  EXPECT_EQ(fault_of("\xEF\xBB\xBF \n{\"a\": 1}"), "none");
  EXPECT_FALSE(json_of_file(scratch_.path(), 1, "").has_value());
  EXPECT_FALSE(json_of_file(path_ + ".none", 1, "").has_value());
}

TEST_F(JsonOfFile, NamesPlaceOfFault) {
  EXPECT_EQ(fault_of("{\"a\": 1,\n  \"b\": }"), "line 2, column 8: is not JSON");
  EXPECT_EQ(fault_of("{\"a\": [1, 2"), "line 1, column 12: the JSON is cut off");
}

TEST_F(JsonOfFile, StopsWhenRequested) {
  std::ofstream(path_, std::ios::binary) << "[" << std::string(1000000, ' ') << "]";
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(static_cast<void>(json_of_file(path_, std::uint64_t{1} << 30, "", stop.get_token())),
               stream::Stopped);
}

TEST_F(JsonOfFile, RejectsOtherFormatsEarly) {
  EXPECT_EQ(fault_of("SQLite format 3\0" + std::string(1000000, 'x')), "is not JSON");
  EXPECT_EQ(fault_of("[" + std::string(100000, ' ') + "]"),
            "is larger than the 64 KiB that such a file may have");
}

}  // namespace
}  // namespace terrace::terrain
