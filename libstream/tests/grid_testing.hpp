// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "gdal_tools.hpp"
#include "raster_testing.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The fixture of tests of elevation grids other than GeoTIFF, which are compared with GDAL.
class Grids : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  /// Writes a file and returns its path.
  std::string put(const std::string& name, const std::string& content) const {
    std::ofstream(path(name), std::ios::binary) << content;
    return path(name);
  }

  /// Runs a command in the folder.
  void run(const std::string& command) const {
    const std::string line =
        "cd '" + folder_.path().string() + "' && " + command + " >/dev/null 2>&1";
    ASSERT_EQ(std::system(line.c_str()), 0) << command;
  }

  /// Writes a GeoTIFF to convert: 16-bit heights with voids, in degrees or metres.
  void make_tiff(const std::string& name, int columns, int rows, const std::string& options) const {
    std::string text = "ncols " + std::to_string(columns) + "\nnrows " + std::to_string(rows) +
                       "\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value -32768\n";
    std::uint32_t state = 1;
    for (int i = 0; i < columns * rows; ++i) {
      state = state * 1664525u + 1013904223u;
      text += state >> 28 == 0 ? "-32768" : std::to_string(static_cast<int>(state >> 20) - 100);
      text += (i + 1) % columns == 0 ? '\n' : ' ';
    }
    put("heights.asc", text);
    run("gdal_translate -q -of GTiff -ot Int16 " + options + " heights.asc " + name);
  }

  static std::unique_ptr<PointSource> open_one(const std::string& file,
                                               const SourceOptions& options = {}) {
    return open_source(std::span(&file, 1), options);
  }

  /// Returns the message of the Error of reading the file, one line; empty if it can be read.
  static std::string refusal_of(const std::string& file, const SourceOptions& options = {}) {
    try {
      const auto source = open_one(file, options);
      PointBlock block;
      while (source->next(block)) {
      }
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return error.what();
    }
    return {};
  }

  /// Expects the same cells in the same places, with the same nodata cells.
  static void expect_same(Raster& found, Raster& expected) {
    const WholeRaster a = read_whole(found), b = read_whole(expected);
    ASSERT_EQ(a.info.columns, b.info.columns);
    ASSERT_EQ(a.info.rows, b.info.rows);
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_NEAR(a.info.world.xy[i], b.info.world.xy[i],
                  1e-9 * (1 + std::abs(b.info.world.xy[i])));
    }
    const Channel &za = a.info.sample, &zb = b.info.sample;
    for (std::size_t i = 0; i < a.cells(); ++i) {
      ASSERT_EQ(a.valid[i], b.valid[i]) << i;
      if (a.valid[i] == 0) continue;
      const double x = a.value(i) * za.scale + za.offset, y = b.value(i) * zb.scale + zb.offset;
      // GDAL converts decimals to floats.
      const bool rounded = zb.type == ScalarType::f32;
      ASSERT_EQ(rounded ? static_cast<float>(x) : x, y) << i;
    }
    // Also by windows.
    std::vector<std::byte> samples(7 * 3 * size_of(za.type));
    std::vector<std::uint8_t> valid(7 * 3);
    const std::uint64_t row = a.info.rows / 2, column = a.info.columns / 3;
    const std::uint64_t rows = std::min<std::uint64_t>(3, a.info.rows - row);
    const std::uint64_t columns = std::min<std::uint64_t>(6, a.info.columns - column);
    found.read_over({column, row, columns, rows}, {samples.data(), valid.data(), 7});
    for (std::uint64_t r = 0; r < rows; ++r) {
      for (std::uint64_t c = 0; c < columns; ++c) {
        const std::size_t cell = (row + r) * a.info.columns + column + c;
        ASSERT_EQ(valid[r * 7 + c], a.valid[cell]);
        if (a.valid[cell] != 0) {
          ASSERT_EQ(std::memcmp(&samples[(r * 7 + c) * size_of(za.type)],
                                &a.samples[cell * size_of(za.type)], size_of(za.type)),
                    0);
        }
      }
    }
  }

  TempFolder folder_;
};

}  // namespace terrace::stream
