// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/memory_source.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// A row as a program might have it: unaligned coordinates with an attribute between them.
#pragma pack(push, 1)
struct PackedRow {
  std::uint8_t kind;
  std::int32_t x;
  float y;
  double z;
};
#pragma pack(pop)

MemoryPoints points_of_rows(const std::vector<PackedRow>& rows) {
  MemoryPoints points;
  points.info.files = {"<rows>"};
  points.info.coordinates[0] = {.name = "x", .type = ScalarType::i32, .scale = 0.5};
  points.info.coordinates[1] = {.name = "y", .type = ScalarType::f32};
  points.info.coordinates[2] = {.name = "z", .type = ScalarType::f64};
  points.info.attributes = {{.name = "kind", .type = ScalarType::u8}};
  points.count = rows.size();
  const auto* bytes = reinterpret_cast<const std::byte*>(rows.data());
  const auto column = [&](std::size_t offset) {
    return MemoryColumn{rows.empty() ? nullptr : bytes + offset, std::ptrdiff_t{sizeof(PackedRow)}};
  };
  points.coordinates = {column(offsetof(PackedRow, x)), column(offsetof(PackedRow, y)),
                        column(offsetof(PackedRow, z))};
  points.attributes = {column(offsetof(PackedRow, kind))};
  return points;
}

std::vector<PackedRow> some_rows() {
  std::vector<PackedRow> rows;
  for (int i = 0; i < 2500; ++i) {
    rows.push_back({static_cast<std::uint8_t>(i % 7), i, 0.25F * static_cast<float>(i), -1.5 * i});
  }
  return rows;
}

TEST(MemorySource, DeliversPointsInOrderWithTheirAttributes) {
  const std::vector<PackedRow> rows = some_rows();
  for (const std::size_t ahead : {std::size_t{0}, std::size_t{3}}) {
    const auto source =
        open_memory(points_of_rows(rows), {.block_points = 1000, .blocks_ahead = ahead});
    EXPECT_EQ(source->info().points, rows.size());
    PointBlock block;
    std::size_t row_number = 0;
    while (source->next(block)) {
      ASSERT_LE(block.size(), 1000U);
      for (std::size_t i = 0; i < block.size(); ++i, ++row_number) {
        const PackedRow row = rows[row_number];
        EXPECT_EQ(block.positions[i], (Point3{double(row.x), double(row.y), row.z}));
        EXPECT_EQ(static_cast<std::uint8_t>(block.payload[i]), row.kind);
      }
    }
    EXPECT_EQ(row_number, rows.size());
  }
}

TEST(MemorySource, SelectsPointsAndReadsColumnsBackwards) {
  const std::vector<PackedRow> rows = some_rows();
  MemoryPoints points = points_of_rows(rows);
  for (MemoryColumn* column : {&points.coordinates[0], &points.coordinates[1],
                               &points.coordinates[2], &points.attributes[0]}) {
    column->first += static_cast<std::ptrdiff_t>(rows.size() - 1) * column->stride;
    column->stride = -column->stride;
  }
  SourceOptions options;
  options.selection.where = "kind == 3";
  options.crs.emplace().epsg = 32632;
  const auto source = open_memory(std::move(points), options);
  EXPECT_EQ(source->info().crs.epsg, 32632);
  PointBlock block;
  std::size_t row_number = 0;
  double last = std::numeric_limits<double>::infinity();
  while (source->next(block)) {
    for (const Point3& p : block.positions) {
      EXPECT_EQ(static_cast<int>(p[0]) % 7, 3);
      EXPECT_LT(p[0], last);
      last = p[0];
      ++row_number;
    }
  }
  EXPECT_EQ(row_number, 357U);
}

TEST(MemorySource, SkipsAndCountsPointsWithNaN) {
  std::vector<PackedRow> rows = some_rows();
  for (std::size_t i = 100; i < 350; ++i) rows[i].z = std::nan("");  // more than a block
  rows.back().y = std::nanf("");
  const auto source = open_memory(points_of_rows(rows), {.block_points = 100});
  PointBlock block;
  std::vector<Point3> positions;
  while (source->next(block)) {
    ASSERT_EQ(block.payload.size(), block.size());
    for (std::size_t i = 0; i < block.size(); ++i) {
      const Point3& place = block.positions[i];
      EXPECT_EQ(block.payload[i], std::byte(static_cast<int>(place[0]) % 7));
      positions.push_back(place);
    }
  }
  EXPECT_EQ(positions.size(), rows.size() - 251);
  EXPECT_EQ(positions[100], (Point3{350, 87.5, -525}));
  EXPECT_EQ(source->progress().points, positions.size());
  EXPECT_EQ(source->progress().nodata, 251U);
}

TEST(MemorySource, RejectsInfiniteCoordinates) {
  std::vector<PackedRow> rows = some_rows();
  rows[1234].z = -std::numeric_limits<double>::infinity();
  const auto source = open_memory(points_of_rows(rows));
  PointBlock block;
  try {
    while (source->next(block)) {
    }
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.parts().where, "point 1234");
    EXPECT_EQ(error.parts().file, "<rows>");
  }
  EXPECT_FALSE(open_memory(points_of_rows({}))->next(block));
}

TEST(MemorySource, RastersSkipCellsWithoutData) {
  // Part of a larger array, transposed: a row step in memory is a column step here.
  constexpr std::uint64_t kColumns = 37, kRows = 53;
  std::vector<float> samples(kColumns * kRows * 2);
  const auto index = [](std::uint64_t column, std::uint64_t row) {
    return (column * kRows + row) * 2;
  };
  std::map<std::pair<double, double>, double> expected;
  for (std::uint64_t c = 0; c < kColumns; ++c) {
    for (std::uint64_t r = 0; r < kRows; ++r) {
      float& sample = samples[index(c, r)];
      sample = static_cast<float>(c * 100 + r);
      if (c % 5 == 0 && r % 3 == 0) {
        sample = c % 2 == 0 ? -9999.0F : std::numeric_limits<float>::quiet_NaN();
      } else {
        expected[{double(c), double(r)}] = double(sample);
      }
    }
  }
  MemoryRaster raster;
  raster.info.files = {"<array>"};
  raster.info.columns = kColumns;
  raster.info.rows = kRows;
  raster.info.sample = {.name = "sample", .type = ScalarType::f32};
  raster.info.nodata = -9999.0;
  raster.first = reinterpret_cast<const std::byte*>(samples.data());
  raster.column_stride = kRows * 2 * sizeof(float);
  raster.row_stride = 2 * sizeof(float);
  const auto source = open_memory(raster, {.block_points = 100});
  EXPECT_TRUE(source->info().grid);
  PointBlock block;
  while (source->next(block)) {
    for (const Point3& p : block.positions) {
      const auto cell = expected.find({p[0], p[1]});
      ASSERT_NE(cell, expected.end());
      EXPECT_EQ(cell->second, p[2]);
      expected.erase(cell);
    }
  }
  EXPECT_TRUE(expected.empty());
  EXPECT_EQ(source->progress().nodata, 8U * 18U);
}

TEST(MemorySource, RejectsColumnsThatDoNotMatchTheAttributes) {
  MemoryPoints points = points_of_rows({});
  points.attributes.emplace_back();
  EXPECT_THROW((void)open_memory(points), std::invalid_argument);
}

}  // namespace
}  // namespace terrace::stream
