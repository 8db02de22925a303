// SPDX-License-Identifier: Apache-2.0 Compares files of selected points, and of points near a
// place, with points visited one by one.
#include "terrace/terrain/detail_points.hpp"

#include <cstring>
#include <fstream>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/source.hpp>
#include <terrace/stream/store.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/near_points.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {
namespace {

using tests::TemporaryFolder;

/// Builds a store of 20,000 numbered points in a square of 100 m.
stream::Store numbered_points(const TemporaryFolder& folder) {
  const std::filesystem::path text = folder.path() / "points.csv";
  std::mt19937_64 random(3);
  {
    std::ofstream file(text);
    file << "x,y,z,number\n";
    for (int i = 0; i < 20000; ++i) {
      const auto coordinate = [&] { return static_cast<double>(random() % 10000) / 100; };
      file << coordinate() << ',' << coordinate() << ',' << coordinate() / 10 << ',' << i << '\n';
    }
  }
  BuildRequest request;
  request.inputs = {text.string()};
  request.store = folder.path() / "store";
  request.block_points = 1000;
  build_store(request);
  return stream::Store::open(request.store);
}

/// Positions and the bytes of all attributes.
using Written = std::vector<std::pair<stream::Point3, std::vector<std::byte>>>;

Written read_back(const std::filesystem::path& path) {
  const std::vector<std::string> files{path.string()};
  const auto source = stream::open_source(files);
  const std::size_t payload = source->info().payload_size();
  Written points;
  stream::PointBlock block;
  while (source->next(block)) {
    for (std::size_t i = 0; i < block.positions.size(); ++i) {
      const auto at = block.payload.begin() + static_cast<std::ptrdiff_t>(i * payload);
      points.emplace_back(block.positions[i],
                          std::vector<std::byte>(at, at + static_cast<std::ptrdiff_t>(payload)));
    }
  }
  return points;
}

TEST(DetailPoints, WritesWantedPointsInOrder) {
  const TemporaryFolder folder;
  const stream::Store store = numbered_points(folder);
  const std::size_t payload = store.schema().payload_size();
  ASSERT_GT(payload, 0u);
  const std::vector<Detail> details{
      {.level = 0},
      {.level = store.top()},
      {.level = 0, .region = Region::parse("20,30,60,50")},
      {.level = store.top(), .focuses = {{.region = Region::parse("0,0,10,10"), .level = 0}}}};
  for (const Detail& detail : details) {
    Written due;
    for_each_wanted_point(store, detail,
                          [&](stream::ClusterId, const stream::ClusterPoints& points, std::size_t i,
                              const stream::Point3& place) {
                            const auto* const at = points.payload.data() + i * payload;
                            due.emplace_back(place, std::vector<std::byte>(at, at + payload));
                          });
    ASSERT_FALSE(due.empty());
    for (const unsigned threads : {1u, 3u}) {
      const std::filesystem::path path = folder.path() / "points.ply";
      const auto writer = stream::open_point_writer(
          path.string(), {.attributes = store.schema().attributes}, {.replace = true});
      EXPECT_EQ(write_points(store, detail, *writer, {}, nullptr, {.threads = threads}), 0u);
      writer->finish();
      EXPECT_EQ(read_back(path), due);
    }
  }
}

TEST(DetailPoints, WritesDistancesOfNearPoints) {
  const TemporaryFolder folder;
  const stream::Store store = numbered_points(folder);
  const std::size_t payload = store.schema().payload_size();
  stream::StoreQuery query(store);
  const auto found = nearest_points(query, {.xy = {40, 60}}, 100);
  std::vector<stream::Channel> attributes = store.schema().attributes;
  attributes.push_back({.name = "distance", .unit = "metre"});
  const std::filesystem::path path = folder.path() / "near.ply";
  const auto writer = stream::open_point_writer(path.string(), {.attributes = attributes}, {});
  write_found_points(query, found, *writer);
  writer->finish();
  const Written points = read_back(path);
  ASSERT_EQ(points.size(), found.size());
  const std::vector<std::byte> kept = query.attributes(found);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(points[i].first, world_point(store.schema(), found[i].position));
    ASSERT_EQ(points[i].second.size(), payload + sizeof(double));
    EXPECT_EQ(std::memcmp(points[i].second.data(), kept.data() + i * payload, payload), 0);
    double distance = 0;
    std::memcpy(&distance, points[i].second.data() + payload, sizeof distance);
    EXPECT_EQ(distance, found[i].distance);
  }
}

}  // namespace
}  // namespace terrace::terrain
