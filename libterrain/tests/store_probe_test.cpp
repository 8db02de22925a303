// SPDX-License-Identifier: Apache-2.0
// Compares the answers of StoreProbe with the library's samplers, with all bytes available and with
// none at first.
#include "sample/store_probe.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/given_bytes.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/heights.hpp"
#include "terrace/terrain/profile.hpp"
#include "test_raster.hpp"

namespace terrace::terrain {
namespace {

using stream::Point3;

constexpr std::uint32_t kColumns = 300, kRows = 260;

/// Builds a raster of hills in metres, with a lake and some single samples without data.
std::filesystem::path built_raster(const tests::TemporaryFolder& folder) {
  stream::GeoTiffOptions options;
  options.nodata = -9999;
  options.columns = kColumns;
  options.rows = kRows;
  options.world.xy = {30, 0, 500000, 0, -30, 5200000};
  options.crs.epsg = 32632;
  const std::string file = (folder.path() / "hills.tif").string();
  tests::write_test_raster(file, options, [&](std::uint32_t column, std::uint32_t row) {
    const bool lake = column > 100 && column < 160 && row > 90 && row < 140;
    if (lake || (column * 31 + row * 17) % 97 == 0) return -9999.0;
    return 300.0 + 150.0 * std::sin(column / 17.0) * std::cos(row / 23.0) + (column * row) % 7;
  });
  BuildRequest request{.inputs = {file}, .store = folder.path() / "hills"};
  request.block_points = 1000;
  build_store(request);
  return request.store;
}

/// A store without any bytes at first, which supplies those that a query lacks.
class Remote {
 public:
  explicit Remote(const std::filesystem::path& folder) {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      files_[name] = stream::open_file(entry.path());
      given_.add_file(name, files_[name]->size());
    }
    rounds_ = 0;
    store_ = ask([&] { return stream::Store::open("remote", given_.open()); });
  }
  [[nodiscard]] const stream::Store& store() const { return *store_; }
  [[nodiscard]] int rounds() const { return rounds_; }
  [[nodiscard]] std::uint64_t bytes() const { return given_.bytes(); }
  template <class Question>
  auto ask(const Question& question) -> std::optional<decltype(question())> {
    for (rounds_ = 0; rounds_ < 100; ++rounds_) {
      try {
        return question();
      } catch (const stream::MissingBytes& missing) {
        for (const stream::ByteRange& range : missing.ranges()) {
          std::vector<std::byte> bytes(range.bytes);
          files_.at(range.file)->read(range.offset, bytes);
          given_.give(range.file, range.offset, bytes);
        }
      }
    }
    return std::nullopt;
  }

 private:
  std::map<std::string, std::shared_ptr<const stream::ByteSource>> files_;
  stream::GivenBytes given_;
  std::optional<stream::Store> store_;
  int rounds_ = 0;
};

void expect_same(double a, double b, const std::string& where) {
  EXPECT_EQ(std::isnan(a), std::isnan(b)) << where << ": " << a << " for " << b;
  if (!std::isnan(b)) {
    EXPECT_NEAR(a, b, 1e-9 * (1 + std::abs(b))) << where;
  }
}

constexpr stream::LinearMap kGround{30, 0, 0, 0, -30, 0, 0, 0, 1};

TEST(StoreProbes, RasterHeightsMatchSampler) {
  const tests::TemporaryFolder folder;
  const std::filesystem::path path = built_raster(folder);
  const stream::Store store = stream::Store::open(path);
  Remote remote(path);
  StoreProbe near(store, kGround), far(remote.store(), kGround);
  std::vector<Point2> places;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> column(-1, kColumns), row(-1, kRows);
  for (int i = 0; i < 400; ++i) {
    Point2 place{column(random), row(random)};
    if (i % 4 == 1) place[0] = std::floor(place[0]);
    if (i % 4 == 2) place[1] = std::floor(place[1]);
    if (i % 8 == 3) place = {std::floor(place[0]), std::floor(place[1])};
    if (i % 8 == 7) place[1] = std::floor(place[1]) + 1 - (place[0] - std::floor(place[0]));
    places.push_back(place);
  }
  std::vector<SurfacePoint> expected(places.size());
  make_sampler(store)->sample(places, expected);
  int rounds = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto found = near.on_raster(places[i][0], places[i][1]);
    const auto later = remote.ask([&] { return far.on_raster(places[i][0], places[i][1]); });
    rounds = std::max(rounds, remote.rounds());
    ASSERT_TRUE(later);
    ASSERT_EQ(found.has_value(), later->has_value());
    expect_same(found ? found->stored[2] : NAN, expected[i].height, std::to_string(i));
    if (found) {
      EXPECT_EQ((*later)->stored, found->stored);
    }
  }
  // The index and the clusters of each level.
  EXPECT_LE(rounds, 2 * static_cast<int>(store.levels().size()) + 1);
}

TEST(StoreProbes, RasterProfilesMatchLibrary) {
  const tests::TemporaryFolder folder;
  const std::filesystem::path path = built_raster(folder);
  const stream::Store store = stream::Store::open(path);
  Remote remote(path);
  StoreProbe far(remote.store(), kGround);
  const auto world = [](const Point2& p) {
    return Point2{500000 + 30 * p[0], 5200000 - 30 * p[1]};
  };
  for (const auto& way : std::vector<std::array<Point2, 2>>{
           {{{10.3, 20.7}, {290.1, 250.9}}},
           {{{130.5, 10.2}, {130.5, 240.4}}},
           {{{250.25, 120.5}, {3.5, 120.5}}},
           {{{20.5, 200.25}, {20.75, 200.5}}},
       }) {
    const Point2 &from = way[0], &to = way[1];
    std::vector<ProfilePoint> expected;
    profile(store, {.line = {world(from), world(to)}},
            [&](auto points) { expected.insert(expected.end(), points.begin(), points.end()); });
    const auto found = remote.ask([&] {
      return far.profile({from[0], from[1], 0}, {to[0], to[1], 0}, 2);
    });
    ASSERT_TRUE(found);
    EXPECT_FALSE(found->sampled);
    EXPECT_EQ(found->level, 0u);
    EXPECT_NEAR(found->metres,
                30 * std::sqrt((to[0] - from[0]) * (to[0] - from[0]) +
                               (to[1] - from[1]) * (to[1] - from[1])),
                1e-6);
    ASSERT_EQ(found->points.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      expect_same(found->points[i][1], expected[i].height, std::to_string(i));
    }
  }
  // A short line reads little.
  Remote other(path);
  StoreProbe brief(other.store(), kGround);
  ASSERT_TRUE(other.ask([&] { return brief.profile({20, 200, 0}, {22, 201, 0}, 2); }));
  EXPECT_LT(other.bytes(), store.bytes() / 3);
}

TEST(StoreProbes, FindNearestOfAllPoints) {
  const tests::TemporaryFolder folder;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(0, 100);
  std::vector<Point3> all;
  {
    std::ofstream file(folder.path() / "cloud.xyz");
    file.precision(17);
    for (int i = 0; i < 20'000; ++i) {
      all.push_back({any(random), any(random), any(random) / 10});
      file << all.back()[0] << ' ' << all.back()[1] << ' ' << all.back()[2] << '\n';
    }
  }
  BuildRequest request{.inputs = {(folder.path() / "cloud.xyz").string()},
                       .store = folder.path() / "cloud"};
  request.block_points = 500;
  build_store(request);
  Remote remote(request.store);
  StoreProbe probe(remote.store(), stream::kIdentityMap);
  for (int i = 0; i < 50; ++i) {
    const Point3 place{any(random), any(random), any(random) / 10};
    const auto square = [&](const Point3& p) {
      return (p[0] - place[0]) * (p[0] - place[0]) + (p[1] - place[1]) * (p[1] - place[1]) +
             (p[2] - place[2]) * (p[2] - place[2]);
    };
    double least = 1e9;
    for (const Point3& p : all) least = std::min(least, square(p));
    const auto found = remote.ask([&] { return probe.nearest(place, 3); });
    ASSERT_TRUE(found);
    ASSERT_EQ(found->has_value(), least <= 9);
    if (!*found) continue;
    EXPECT_DOUBLE_EQ(square((*found)->stored), least);
    EXPECT_EQ((*found)->level, 0u);
    EXPECT_FALSE(*remote.ask([&] { return probe.nearest(place, std::sqrt(least) * 0.999); }));
  }
  const Point3 from{10, 20, 5}, to{90, 70, 1};
  const auto strip = remote.ask([&] { return probe.profile(from, to, 2); });
  ASSERT_TRUE(strip);
  const double length = std::sqrt(80.0 * 80 + 50 * 50);
  std::size_t expected = 0;
  for (const Point3& p : all) {
    const double along = ((p[0] - 10) * 80 + (p[1] - 20) * 50) / length;
    const double aside = ((p[1] - 20) * 80 - (p[0] - 10) * 50) / length;
    expected += along >= 0 && along <= length && std::abs(aside) <= 0.01 * length ? 1 : 0;
  }
  EXPECT_NEAR(strip->metres, length, 1e-9);
  EXPECT_EQ(strip->points.size(), expected);
  EXPECT_TRUE(remote.ask([&] { return probe.profile(from, from, 2); })->points.empty());
}

}  // namespace
}  // namespace terrace::terrain
