// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/random.hpp>
#include <terrace/stream/geotiff_writer.hpp>
#include <terrace/stream/store.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "tile/make/height_blocks.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

class HeightBlocksOfAStore : public ::testing::Test {
 protected:
  static constexpr std::int64_t kColumns = 150, kRows = 90, kSide = 16;
  static constexpr float kNodata = -9999.0F;

  void SetUp() override {
    for (std::int64_t row = 0; row < kRows; ++row) {
      for (std::int64_t column = 0; column < kColumns; ++column) {
        const double x = static_cast<double>(column), y = static_cast<double>(row);
        const bool there = random() < 0.9 && std::hypot(x - 60.0, y - 40.0) > 30.0;
        const double height = 100 * std::sin(x / 20) + 50 * random();
        heights_.push_back(there ? static_cast<float>(height) : kNodata);
      }
    }
    stream::GeoTiffOptions tiff;
    tiff.columns = kColumns;
    tiff.rows = kRows;
    tiff.sample.name = "height";
    tiff.sample.type = stream::ScalarType::f32;
    tiff.world.xy = {30, 0, 400000, 0, -30, 5200000};
    tiff.nodata = static_cast<double>(kNodata);
    stream::GeoTiffWriter writer(folder_ / "dem.tif", tiff);
    writer.write_rows(std::as_bytes(std::span(heights_)));
    writer.commit();
    BuildRequest request;
    request.inputs = {(folder_ / "dem.tif").string()};
    request.store = folder_ / "dem.terrace";
    request.block_points = 500;
    build_store(request);
  }

  double random() {
    seed_ = base::splitmix64(seed_);
    return base::unit_interval(seed_);
  }
  [[nodiscard]] stream::Store store() const { return stream::Store::open(folder_ / "dem.terrace"); }

  struct Seen {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    int samples = 0;
  };
  [[nodiscard]] Seen look(const LatticeWindow& window) const {
    Seen seen;
    for (std::int64_t row = std::max<std::int64_t>(window.row, 0);
         row < std::min(window.row + window.rows, kRows); ++row) {
      for (std::int64_t column = std::max<std::int64_t>(window.column, 0);
           column < std::min(window.column + window.columns, kColumns); ++column) {
        const float height = heights_[static_cast<std::size_t>(row * kColumns + column)];
        if (height == kNodata) continue;
        ++seen.samples;
        seen.low = std::min(seen.low, static_cast<double>(height));
        seen.high = std::max(seen.high, static_cast<double>(height));
      }
    }
    return seen;
  }

  LatticeWindow window() {
    const auto from = static_cast<std::int64_t>(random() * 190) - 20;
    const auto row = static_cast<std::int64_t>(random() * 130) - 20;
    return {from, row, 1 + static_cast<std::int64_t>(random() * random() * 120),
            1 + static_cast<std::int64_t>(random() * random() * 90)};
  }

  std::uint64_t seed_ = 17;
  std::vector<float> heights_;
  tests::TemporaryFolder scratch_;
  const fs::path& folder_ = scratch_.path();
};

TEST_F(HeightBlocksOfAStore, RangesMatchBlocks) {
  const HeightBlocks blocks(store(), 2);
  int empty = 0;
  for (int round = 0; round < 3000; ++round) {
    const LatticeWindow asked = window();
    SCOPED_TRACE(testing::Message() << "round " << round << ": " << asked.column << "," << asked.row
                                    << " " << asked.columns << " x " << asked.rows);
    const std::int64_t right = std::min(asked.column + asked.columns, kColumns);
    const std::int64_t bottom = std::min(asked.row + asked.rows, kRows);
    const std::int64_t x0 = std::max<std::int64_t>(asked.column, 0) / kSide * kSide;
    const std::int64_t y0 = std::max<std::int64_t>(asked.row, 0) / kSide * kSide;
    LatticeWindow grown{};
    if (right > x0 && bottom > y0 && right > 0 && bottom > 0) {
      grown = {x0, y0, (right + kSide - 1) / kSide * kSide - x0,
               (bottom + kSide - 1) / kSide * kSide - y0};
    }
    const Seen expected = look(grown);
    const auto range = blocks.range(asked);
    ASSERT_EQ(range.has_value(), expected.samples > 0);
    if (range) {
      EXPECT_EQ(range->low, expected.low);
      EXPECT_EQ(range->high, expected.high);
    }
    empty += range ? 0 : 1;
  }
  EXPECT_GT(empty, 20);
}

TEST_F(HeightBlocksOfAStore, FindsBlockWithDataInWindow) {
  const HeightBlocks blocks(store(), 2);
  int found = 0, none = 0;
  for (int round = 0; round < 3000; ++round) {
    const LatticeWindow asked = window();
    SCOPED_TRACE(testing::Message() << "round " << round << ": " << asked.column << "," << asked.row
                                    << " " << asked.columns << " x " << asked.rows);
    const auto block = blocks.some_block_within(asked);
    if (block) {
      ++found;
      EXPECT_GE(block->column, asked.column);
      EXPECT_GE(block->row, asked.row);
      EXPECT_LE(block->column + block->columns, asked.column + asked.columns);
      EXPECT_LE(block->row + block->rows, asked.row + asked.rows);
      EXPECT_GT(look(*block).samples, 0);
      continue;
    }
    ++none;
    for (std::int64_t y = 0; y + kSide <= std::min(kRows, asked.row + asked.rows); y += kSide) {
      for (std::int64_t x = 0; x + kSide <= std::min(kColumns, asked.column + asked.columns);
           x += kSide) {
        if (x < asked.column || y < asked.row) continue;
        EXPECT_EQ(look({x, y, kSide, kSide}).samples, 0) << x << "," << y;
      }
    }
  }
  EXPECT_GT(found, 100);
  EXPECT_GT(none, 100);
}

}  // namespace
}  // namespace terrace::terrain
