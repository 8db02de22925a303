// SPDX-License-Identifier: GPL-3.0-or-later
// Compares windows of a store with the whole store decoded: a raster with holes and a cloud, caches
// of any size, several threads, and a damaged store.
#include "surface/store_window.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/geotiff_writer.hpp>
#include <terrace/stream/store.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "terrace/terrain/build.hpp"

namespace terrace {
namespace {

constexpr std::uint32_t kColumns = 413, kRows = 307;
constexpr std::int16_t kNodata = -32768;

std::filesystem::path build(const std::filesystem::path& input, const std::string& name,
                            std::size_t block_points) {
  terrain::BuildRequest request;
  request.inputs = {input.string()};
  request.store = input.parent_path() / name;
  request.block_points = block_points;  // small blocks give more levels
  request.facility_cost = 1.0;
  terrain::build_store(request);
  return request.store;
}

std::filesystem::path raster_store(const std::filesystem::path& folder, double scale) {
  stream::GeoTiffOptions options;
  options.columns = kColumns;
  options.rows = kRows;
  options.sample.type = stream::ScalarType::i16;
  options.sample.scale = scale;
  options.sample.offset = scale == 1.0 ? 0.0 : -17.5;
  options.world.xy = {30, 0, 500000, 0, -30, 5200000};
  options.nodata = kNodata;
  std::vector<std::int16_t> samples;
  for (std::uint32_t row = 0; row < kRows; ++row) {
    for (std::uint32_t column = 0; column < kColumns; ++column) {
      const bool hole = std::hypot(column - 120.0, row - 90.0) < 60 || (column * row) % 91 == 7;
      samples.push_back(hole ? kNodata
                             : static_cast<std::int16_t>(700 * std::sin(column / 40.0) +
                                                         (column * 7 + row * 3) % 37));
    }
  }
  const auto file = folder / "dem.tif";
  stream::GeoTiffWriter writer(file, options);
  writer.write_rows(std::as_bytes(std::span(samples)));
  writer.commit();
  return build(file, "dem.store", 1500);
}

std::filesystem::path cloud_store(const std::filesystem::path& folder) {
  std::mt19937_64 random(5);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const auto file = folder / "cloud.xyz";
  std::ofstream out(file);
  out.precision(17);
  for (int i = 0; i < 40000; ++i) {
    const double x = unit() * unit() * 1000 - 300, y = unit() * 500;
    out << x << ' ' << y << ' ' << 10 * std::sin(x / 50) + unit() << '\n';
    // Some duplicates.
    if (i % 50 == 0) out << x << ' ' << y << ' ' << 99 + unit() << '\n';
  }
  out.close();
  return build(file, "cloud.store", 300);
}

/// Every point with its level, read by Store::for_each alone.
struct EveryPoint {
  std::vector<stream::Point3> positions;
  std::vector<unsigned> levels;

  explicit EveryPoint(const stream::Store& store) {
    for (unsigned level = 0; level <= store.top(); ++level) {
      store.for_each(level, [&](stream::ClusterId, const stream::ClusterRecord&,
                                const stream::ClusterPoints& points) {
        for (const stream::Point3& p : points.positions) {
          positions.push_back(p);
          levels.push_back(level);
        }
      });
    }
  }

  [[nodiscard]] std::vector<double> heights(const stream::Store& store,
                                            const terrain::LatticeWindow& window,
                                            unsigned level) const {
    std::vector<double> grid(window.size(), std::numeric_limits<double>::quiet_NaN());
    const stream::Channel& channel = store.schema().coordinates[2];
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const auto column = static_cast<std::int64_t>(positions[i][0]) - window.column;
      const auto row = static_cast<std::int64_t>(positions[i][1]) - window.row;
      if (levels[i] < level || column < 0 || row < 0 || column >= window.columns ||
          row >= window.rows) {
        continue;
      }
      grid[static_cast<std::size_t>(row * window.columns + column)] =
          positions[i][2] * channel.scale + channel.offset;
    }
    return grid;
  }
};

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<double>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](T x, double y) {
    return std::isnan(x) ? std::isnan(y) : static_cast<double>(x) == y;
  });
}

terrain::LatticeWindow random_window(std::mt19937_64& random) {
  terrain::LatticeWindow window;
  window.column = static_cast<std::int64_t>(random() % (kColumns + 60)) - 40;
  window.row = static_cast<std::int64_t>(random() % (kRows + 60)) - 40;
  window.columns = 1 + static_cast<std::int64_t>(random() % 130);
  window.rows = 1 + static_cast<std::int64_t>(random() % 130);
  return window;
}

TEST(StoreWindow, GivesTheSamplesOfARasterAndNaNForItsHoles) {
  for (const double scale : {1.0, 0.25}) {
    SCOPED_TRACE(scale);
    const tests::TemporaryFolder folder;
    const stream::Store store = stream::Store::open(raster_store(folder.path(), scale));
    ASSERT_GE(store.top(), 2u);
    const EveryPoint whole(store);
    const std::uint64_t seed = 71;
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    for (const std::uint64_t cache :
         {std::uint64_t{0}, std::uint64_t{50000}, std::uint64_t{1} << 26}) {
      SCOPED_TRACE(cache);
      terrain::StoreWindow reader(store, cache);
      EXPECT_EQ(reader.float_is_exact(), scale == 1.0);
      for (int i = 0; i < 40; ++i) {
        const terrain::LatticeWindow window = random_window(random);
        const unsigned level = i % 3 == 0 ? static_cast<unsigned>(random() % (store.top() + 1)) : 0;
        std::vector<double> heights(window.size());
        reader.heights(window, std::span(heights), level);
        const std::vector<double> expected = whole.heights(store, window, level);
        ASSERT_TRUE(same_bits(heights, expected))
            << window.column << ' ' << window.row << ' ' << window.columns << ' ' << window.rows;
        if (scale != 1.0) continue;
        std::vector<float> floats(window.size());
        reader.heights(window, std::span(floats), level);
        ASSERT_TRUE(same_bits(floats, expected));
      }
    }
  }
}

TEST(StoreWindow, IsEmptyOutsideTheRaster) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(raster_store(folder.path(), 1.0));
  terrain::StoreWindow reader(store);
  for (const terrain::LatticeWindow window :
       {terrain::LatticeWindow{-500, 0, 20, 20}, terrain::LatticeWindow{kColumns, kRows, 7, 3},
        terrain::LatticeWindow{0, 0, 0, 0}}) {
    std::vector<double> heights(window.size(), 1.0);
    reader.heights(window, std::span(heights));
    for (const double height : heights) EXPECT_TRUE(std::isnan(height));
  }
}

TEST(StoreWindow, GivesThePointsInABoxFromHigherLevelsDown) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(cloud_store(folder.path()));
  ASSERT_GE(store.top(), 2u);
  const EveryPoint whole(store);
  const std::uint64_t seed = 72;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (const std::uint64_t cache : {std::uint64_t{0}, std::uint64_t{1} << 26}) {
    terrain::StoreWindow reader(store, cache);
    terrain::WindowPoints points;
    for (int i = 0; i < 60; ++i) {
      terrain::StoredBox box;
      // Half of the boxes have a corner on a point, because boxes are closed.
      const stream::Point3& corner = whole.positions[random() % whole.positions.size()];
      box.min = {i % 2 == 0 ? corner[0] : unit() * 1000 - 300,
                 i % 2 == 0 ? corner[1] : unit() * 500};
      box.max = {box.min[0] + unit() * 200, box.min[1] + unit() * 200};
      const unsigned level = static_cast<unsigned>(random() % (store.top() + 1));
      reader.points(box, points, level);
      using Key = std::tuple<unsigned, stream::Point3>;
      std::vector<Key> got, expected;
      for (std::size_t k = 0; k < points.positions.size(); ++k) {
        got.emplace_back(points.levels[k], points.positions[k]);
        ASSERT_TRUE(k == 0 || points.levels[k] <= points.levels[k - 1]);
      }
      for (std::size_t k = 0; k < whole.positions.size(); ++k) {
        if (whole.levels[k] >= level && box.contains(terrain::flat(whole.positions[k]))) {
          expected.emplace_back(whole.levels[k], whole.positions[k]);
        }
      }
      std::sort(got.begin(), got.end());
      std::sort(expected.begin(), expected.end());
      ASSERT_EQ(got, expected);
    }
  }
}

TEST(StoreWindow, ReadersOfOneStoreAreIndependent) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(raster_store(folder.path(), 1.0));
  const terrain::LatticeWindow all{0, 0, kColumns, kRows};
  const std::vector<double> expected = EveryPoint(store).heights(store, all, 0);
  std::array<std::vector<double>, 4> results;
  std::vector<std::thread> threads;
  for (std::vector<double>& result : results) {
    threads.emplace_back([&] {
      terrain::StoreWindow reader(store, 100000);
      for (int round = 0; round < 5; ++round) {
        result.assign(all.size(), 0.0);
        reader.heights(all, std::span(result));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::vector<double>& result : results) EXPECT_TRUE(same_bits(result, expected));
}

TEST(StoreWindow, ReportsDamageAndStillReadsTheRest) {
  const tests::TemporaryFolder folder;
  const auto path = raster_store(folder.path(), 1.0);
  const EveryPoint whole(stream::Store::open(path));
  {
    std::fstream file(path / "level-0.0.clusters", std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(0, std::ios::end);
    const std::streamoff middle = file.tellg() / 2;
    file.seekg(middle);
    const int byte = file.get();
    file.seekp(middle);
    file.put(static_cast<char>(byte ^ 16));
  }
  const stream::Store store = stream::Store::open(path);
  terrain::StoreWindow reader(store);
  std::vector<double> all(std::size_t{kColumns} * kRows);
  for (int round = 0; round < 2; ++round) {
    EXPECT_THROW(reader.heights({0, 0, kColumns, kRows}, std::span(all)), stream::Error);
  }
  int damaged = 0, sound = 0;
  constexpr std::int64_t kSide = 40;
  for (std::int64_t row = 0; row < kRows; row += kSide) {
    for (std::int64_t column = 0; column < kColumns; column += kSide) {
      const terrain::LatticeWindow window{column, row, kSide, kSide};
      std::vector<double> heights(window.size());
      try {
        reader.heights(window, std::span(heights));
        ASSERT_TRUE(same_bits(heights, whole.heights(store, window, 0)));
        ++sound;
      } catch (const stream::Error&) {
        ++damaged;
      }
    }
  }
  EXPECT_GE(damaged, 1);
  EXPECT_GE(sound, 60);
}

}  // namespace
}  // namespace terrace
