// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <gtest/gtest.h>

#include "las_files.hpp"
#include "point_files.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {

/// The fixture of tests that write LAS files to a temporary folder and read them.
class Las : public ::testing::Test {
 protected:
  /// Writes a file and returns its path.
  [[nodiscard]] std::string put_file(const std::string& name, const LasParts& parts) const {
    return write_text(folder_.path() / name, parts.bytes());
  }
  /// Returns the message of the Error of reading these bytes; empty if they can be read.
  [[nodiscard]] std::string refusal(const LasParts& parts) const { return refusal(parts.bytes()); }
  [[nodiscard]] std::string refusal(const std::string& bytes) const {
    return error_of([&] { read_file(write_text(folder_.path() / "bad.las", bytes)); });
  }
  /// Writes the points to a file, exactly, and returns its path.
  [[nodiscard]] std::string copy_of(const AllPoints& all,
                                    const std::string& name = "copy.las") const {
    const std::string path = folder_.path() / name;
    const auto writer = open_point_writer(path,
                                          {.attributes = all.info.attributes,
                                           .crs = [&all] { return all.info.crs; },
                                           .lattice = lattice_of(all.info)},
                                          {.replace = true});
    AllPoints world = all;
    to_world(all.info, world.points);
    writer->append(world.points);
    writer->finish();
    EXPECT_EQ(writer->rounding(), 0.0);
    return path;
  }

  TempFolder folder_;
};

}  // namespace terrace::stream
