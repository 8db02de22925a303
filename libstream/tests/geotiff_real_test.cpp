// SPDX-License-Identifier: Apache-2.0
// Real elevation models and GDAL's own collection of TIFF files, compared with GDAL 3.6's results
// (data/dem_facts.tsv: file, columns, rows, type, checksum, valid %, min, max, mean).
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "raster_testing.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"

namespace terrace::stream {
namespace {

struct Facts {
  std::string file, type;
  std::uint64_t columns = 0, rows = 0;
  int checksum = 0;
  double percent = 0;
  std::string min, max, mean;
};

std::vector<Facts> facts() {
  std::ifstream file(TERRACE_TEST_DATA "/dem_facts.tsv");
  std::vector<Facts> all;
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream in(line);
    Facts f;
    std::getline(in, f.file, '\t');
    in >> f.columns >> f.rows >> f.type >> f.checksum >> f.percent >> f.min >> f.max >> f.mean;
    all.push_back(f);
  }
  return all;
}

/// GDALChecksumImage over the raw samples.
int checksum(const WholeRaster& raster, double without_data) {
  static constexpr int kPrimes[11] = {7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43};
  const bool is_float =
      raster.info.sample.type == ScalarType::f32 || raster.info.sample.type == ScalarType::f64;
  constexpr double kMax = std::numeric_limits<std::int32_t>::max();
  int sum = 0;
  for (std::size_t i = 0; i < raster.cells(); ++i) {
    double value = raster.valid[i] != 0 ? raster.value(i) : without_data;
    std::int32_t raster_value = std::numeric_limits<std::int32_t>::min();
    if (std::isfinite(value)) {
      if (is_float) value = std::floor(value + 0.5);
      raster_value =
          static_cast<std::int32_t>(std::min(std::max(value, is_float ? -kMax : -kMax - 1), kMax));
    }
    sum = (sum + raster_value % kPrimes[i % 11]) & 0xffff;
  }
  return sum;
}

TEST(GeoTiffReal, SamplesMatchGdal) {
  const auto folder = real_data();
  if (!folder) GTEST_SKIP() << "needs TERRACE_DATA";
  std::size_t files = 0;
  for (const Facts& f : facts()) {
    SCOPED_TRACE(f.file);
    const std::string path = (*folder / "dem" / f.file).string();
    if (f.file.find("byte_gcp_pixelispoint") != std::string::npos) {
      EXPECT_THROW(open_geotiff(path), Error);
      continue;
    }
    std::unique_ptr<Raster> raster;
    try {
      raster = open_geotiff(path);
    } catch (const Error& error) {
      ADD_FAILURE() << error.what();
      continue;
    }
    const WholeRaster raster_value = read_whole(*raster);
    ++files;
    EXPECT_EQ(raster_value.info.columns, f.columns);
    EXPECT_EQ(raster_value.info.rows, f.rows);
    EXPECT_EQ(name_of(raster_value.info.sample.type), f.type);
    std::size_t count = 0;
    double min = std::numeric_limits<double>::infinity(), max = -min, sum = 0;
    for (std::size_t i = 0; i < raster_value.cells(); ++i) {
      if (raster_value.valid[i] == 0) continue;
      const double value = raster_value.value(i);
      ++count;
      sum += value;
      min = std::min(min, value);
      max = std::max(max, value);
    }
    EXPECT_NEAR(100.0 * static_cast<double>(count) / static_cast<double>(raster_value.cells()),
                f.percent, 0.0051);
    if (f.min != "-") {
      EXPECT_EQ(min, std::stod(f.min));
      EXPECT_EQ(max, std::stod(f.max));
      EXPECT_NEAR(sum / static_cast<double>(count), std::stod(f.mean), 1e-6 * (max - min));
    }
    // GDAL's sum takes the nodata value for cells without data, or NaN unchanged.
    EXPECT_EQ(checksum(raster_value, raster_value.info.nodata.value_or(std::nan(""))), f.checksum);
  }
  EXPECT_GT(files, 100u);
}

}  // namespace
}  // namespace terrace::stream
