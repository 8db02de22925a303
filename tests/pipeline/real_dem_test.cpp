// SPDX-License-Identifier: GPL-3.0-or-later
// Sends every elevation raster of the real-data folder through the whole chain (build, verify, read
// back), which must return every sample. The oracle is gdal_translate, which writes the raster as
// raw samples. Without TERRACE_DATA or GDAL the tests are skipped with the reason.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/source.hpp>
#include <terrace/stream/store.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "terrace/terrain/build.hpp"

namespace terrace {
namespace {

namespace fs = std::filesystem;
using stream::ScalarType;

double value_at(const std::vector<char>& raw, ScalarType type, std::size_t i) {
  const auto read = [&]<class T>(T value) {
    std::memcpy(&value, raw.data() + i * sizeof(T), sizeof(T));
    return static_cast<double>(value);
  };
  switch (type) {
    case ScalarType::i8:
      return read(std::int8_t{});
    case ScalarType::u8:
      return read(std::uint8_t{});
    case ScalarType::i16:
      return read(std::int16_t{});
    case ScalarType::u16:
      return read(std::uint16_t{});
    case ScalarType::i32:
      return read(std::int32_t{});
    case ScalarType::u32:
      return read(std::uint32_t{});
    case ScalarType::i64:
      return read(std::int64_t{});
    case ScalarType::u64:
      return read(std::uint64_t{});
    case ScalarType::f32:
      return read(float{});
    case ScalarType::f64:
      return read(double{});
  }
  return 0;
}

std::vector<char> samples_by_gdal(const fs::path& raster, const fs::path& raw) {
  const std::string command = "gdal_translate -q -b 1 -of ENVI '" + raster.string() + "' '" +
                              raw.string() + "' >/dev/null 2>&1";
  if (std::system(command.c_str()) != 0) return {};
  std::ifstream file(raw, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void expect_every_sample(const fs::path& raster, const fs::path& scratch) {
  SCOPED_TRACE(raster.string());
  terrain::BuildRequest request;
  request.inputs = {raster.string()};
  request.store = scratch / "dem.store";
  request.replace = true;
  const terrain::BuildOutcome outcome = terrain::build_store(request, {.threads = 2});

  const stream::Store store = stream::Store::open(request.store);
  EXPECT_TRUE(store.verify([](const stream::Problem& problem) {
    ADD_FAILURE() << problem.file << ": " << problem.offset << ": " << problem.what;
  }));
  const stream::StoreSchema& schema = store.schema();
  const std::size_t cells = schema.columns * schema.rows;
  EXPECT_EQ(outcome.points + outcome.nodata, cells);
  EXPECT_EQ(store.points(), outcome.points);

  const std::vector<char> raw = samples_by_gdal(raster, scratch / "raw");
  ASSERT_EQ(raw.size(), cells * stream::size_of(schema.coordinates[2].type))
      << "gdal_translate failed or wrote an unexpected type";
  std::vector<bool> seen(cells, false);
  std::uint64_t wrong = 0, twice = 0;
  const auto check = [&](const stream::Point3& p) {
    const auto cell =
        static_cast<std::size_t>(p[1]) * schema.columns + static_cast<std::size_t>(p[0]);
    ASSERT_LT(cell, cells);
    twice += seen[cell] ? 1 : 0;
    seen[cell] = true;
    wrong += value_at(raw, schema.coordinates[2].type, cell) == p[2] ? 0 : 1;
  };
  for (unsigned level = 0; level <= store.top(); ++level) {
    store.for_each(level, [&](stream::ClusterId, const stream::ClusterRecord&,
                              const stream::ClusterPoints& points) {
      for (const stream::Point3& p : points.positions) check(p);
    });
  }
  EXPECT_EQ(wrong, 0u) << "samples that differ from GDAL's";
  EXPECT_EQ(twice, 0u);
  // All samples left out are nodata: a single value, NaN or an infinity.
  const double nodata = stream::open_source(request.inputs)->info().nodata.value_or(NAN);
  std::uint64_t lost = 0;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    if (seen[cell]) continue;
    const double value = value_at(raw, schema.coordinates[2].type, cell);
    const bool is_nodata =
        !std::isfinite(value) || std::abs(value - nodata) <= std::abs(nodata) * 1e-6;
    lost += is_nodata ? 0 : 1;
  }
  EXPECT_EQ(lost, 0u) << "valid samples that the store lacks";
}

class RealDem : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("TERRACE_DATA");
    if (data == nullptr) GTEST_SKIP() << "TERRACE_DATA is not set";
    if (std::system("gdal_translate --version >/dev/null 2>&1") != 0) {
      GTEST_SKIP() << "gdal_translate is not installed";
    }
    folder_ = fs::path(data) / "dem";
  }
  fs::path folder_;
};

void expect_every_sample_in(const fs::path& folder) {
  const tests::TemporaryFolder scratch;
  std::size_t rasters = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".tif") continue;
    ++rasters;
    expect_every_sample(entry.path(), scratch.path());
  }
  EXPECT_GT(rasters, 0u);
}

TEST_F(RealDem, ReturnsEverySample) { expect_every_sample_in(folder_); }
TEST_F(RealDem, ReturnsEverySampleOfEveryEncoding) {
  expect_every_sample_in(folder_ / "encodings");
}

}  // namespace
}  // namespace terrace
