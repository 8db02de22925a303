// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "read_pieces.hpp"
#include "store_editing.hpp"
#include "store_testing.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/store.hpp"

namespace terrace::stream {
namespace {

using testing::PushedBlock;
using testing::uniform;

template <class T>
void append_bytes(std::string& text, const T& value) {
  text.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Returns a hash of the contents of all clusters (points with their attributes, the clusters they
/// head, errors and counts) that does not depend on the order of clusters and members.
std::size_t content_of(const Store& store) {
  const std::size_t stride = store.schema().payload_size();
  std::vector<std::vector<std::size_t>> contents;  // of clusters, by level
  for (unsigned level = 0; level <= store.top(); ++level) {
    std::vector<std::size_t>& level_hashes = contents.emplace_back();
    store.for_each(level, [&](ClusterId, const ClusterRecord& record, const ClusterPoints& points) {
      std::string text;
      const auto point = [&](const Point3& position, const std::byte* payload,
                             const std::uint64_t* children) {
        text.clear();
        append_bytes(text, position);
        text.append(reinterpret_cast<const char*>(payload), stride);
        for (unsigned below = 0; below < level; ++below) {
          append_bytes(text, contents[below][children[below]]);
        }
        return std::hash<std::string>()(text);
      };
      std::vector<std::size_t> members;
      for (std::size_t i = 0; i < points.size(); ++i) {
        members.push_back(point(points.positions[i], points.payload.data() + i * stride,
                                points.children.data() + i * level));
      }
      std::sort(members.begin(), members.end());
      if (points.has_representative) {
        members.push_back(point(points.representative, points.representative_payload.data(),
                                points.representative_children.data()));
      }
      text.clear();
      for (const std::size_t member : members) append_bytes(text, member);
      append_bytes(text, record.summary.error);
      append_bytes(text, record.summary.descendants);
      level_hashes.push_back(std::hash<std::string>()(text));
    });
  }
  return contents.back().front();
}

/// Repacks a store and compares the result with it.
void check_repacked(const std::filesystem::path& folder) {
  const Store before = Store::open(folder / "s");
  const std::uint64_t bytes = repack(before, folder / "r", false, 3);
  const Store after = Store::open(folder / "r");
  EXPECT_EQ(after.bytes(), bytes);
  EXPECT_TRUE(after.verify(testing::fail_on_problem));
  const std::size_t content = content_of(before);
  EXPECT_EQ(content_of(after), content);
  EXPECT_EQ(after.points(), before.points());
  EXPECT_EQ(after.bounds(), before.bounds());
  EXPECT_EQ(after.schema().nodata, before.schema().nodata);
  EXPECT_EQ(after.schema().parameters, before.schema().parameters);
  repack(before, folder / "one", false, 1);
  EXPECT_TRUE(testing::read_files(folder / "one") == testing::read_files(folder / "r"))
      << "the bytes depend on threads";
  // A store that is in order already keeps its contents.
  repack(after, folder / "again", false, 2);
  const Store again = Store::open(folder / "again");
  EXPECT_TRUE(again.verify(testing::fail_on_problem));
  EXPECT_EQ(content_of(again), content);
}

std::vector<PushedBlock> reordered(std::vector<PushedBlock> blocks, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  for (std::size_t i = blocks.size(); i > 1; --i) std::swap(blocks[i - 1], blocks[random() % i]);
  return blocks;
}

TEST(Repack, KeepsContentsOfRasters) {
  for (const ScalarType type : {ScalarType::i16, ScalarType::f32, ScalarType::u64}) {
    for (const auto relief : {testing::ReliefKind::flat, testing::ReliefKind::fractal,
                              testing::ReliefKind::extreme, testing::ReliefKind::decimal}) {
      SCOPED_TRACE(static_cast<int>(type) * 10 + static_cast<int>(relief));
      const TempFolder folder;
      testing::write_store(folder.path() / "s", testing::grid_schema(type),
                           reordered(testing::grid_blocks(type, relief, 100, 90, 20, 1), 2),
                           {.block_points = 400, .cluster_points = 9});
      check_repacked(folder.path());
    }
  }
}

TEST(Repack, KeepsContentsOfClouds) {
  std::mt19937_64 random(7);
  for (const auto kind : {testing::CoordinateKind::decimals, testing::CoordinateKind::floats,
                          testing::CoordinateKind::doubles, testing::CoordinateKind::extremes,
                          testing::CoordinateKind::mixed, testing::CoordinateKind::lines}) {
    SCOPED_TRACE(static_cast<int>(kind));
    StoreSchema schema = testing::cloud_schema();
    for (const ScalarType type : testing::kAllTypes) {
      schema.attributes.push_back(testing::channel("a", type));
      schema.attributes.back().name += std::to_string(schema.attributes.size());
    }
    std::vector<PushedBlock> blocks =
        testing::cloud_blocks(kind, 6000 / TERRACE_TEST_SHARE, 300, 3);
    for (PushedBlock& block : blocks) {
      block.payload.resize(block.positions.size() * schema.payload_size());
      const bool still = random() % 3 == 0;
      for (std::byte& byte : block.payload) byte = still ? std::byte{1} : std::byte(random() % 256);
    }
    const TempFolder folder;
    testing::write_store(folder.path() / "s", schema, blocks,
                         {.block_points = 300, .cluster_points = 10});
    check_repacked(folder.path());
  }
}

/// More than one segment, with different tables, and more blocks than are encoded in parallel.
TEST(Repack, KeepsStoresOfManyBlocks) {
  const TempFolder folder;
  testing::write_store(
      folder.path() / "s", testing::grid_schema(ScalarType::u8),
      testing::grid_blocks(ScalarType::u8, testing::ReliefKind::fractal, 960, 900, 30, 5),
      {.block_points = 900, .cluster_points = 20});
  check_repacked(folder.path());
}

TEST(Repack, KeepsStoresOfFewPoints) {
  for (const std::size_t points : {0u, 1u, 40u}) {
    const TempFolder folder;
    testing::write_store(folder.path() / "s", testing::cloud_schema(),
                         testing::cloud_blocks(testing::CoordinateKind::decimals, points, 20, 1),
                         {.block_points = 50, .cluster_points = 5});
    check_repacked(folder.path());
  }
}

TEST(Repack, ReplacesOnlyIfAsked) {
  const TempFolder folder;
  testing::write_store(folder.path() / "s", testing::cloud_schema(),
                       testing::cloud_blocks(testing::CoordinateKind::decimals, 500, 100, 1),
                       {.block_points = 100, .cluster_points = 5});
  const Store store = Store::open(folder.path() / "s");
  EXPECT_THROW(repack(store, folder.path() / "s"), Error);
  const std::size_t content = content_of(store);
  repack(store, folder.path() / "s", true);
  EXPECT_EQ(content_of(Store::open(folder.path() / "s")), content);
}

/// Neighbouring clusters are read together, however the store was built.
TEST(Repack, ReadsWindowsInFewerPieces) {
  const TempFolder folder;
  const auto write = [&](const char* name, const StoreSchema& schema,
                         const std::vector<PushedBlock>& blocks) {
    testing::write_store(folder.path() / name, schema, blocks,
                         {.block_points = 400, .cluster_points = 10, .scale = {1, 1, 0}});
    const Store store = Store::open(folder.path() / name);
    const std::string packed = std::string(name) + "-packed";
    repack(store, folder.path() / packed);
    const std::vector<Box3> boxes = testing::windows(store.bounds(), 0.12, 30, 11);
    return std::array{testing::pieces_read(folder.path() / name, boxes).clusters,
                      testing::pieces_read(folder.path() / packed, boxes).clusters};
  };
  const auto grid =
      testing::grid_blocks(ScalarType::i16, testing::ReliefKind::fractal, 400, 400, 20, 4);
  const auto in_order = write("rows", testing::grid_schema(ScalarType::i16), grid);
  const auto mixed = write("shuffled", testing::grid_schema(ScalarType::i16), reordered(grid, 9));
  EXPECT_LT(3 * in_order[1], 2 * in_order[0]);
  EXPECT_LT(2 * mixed[1], mixed[0]);
  // The order before repacking hardly makes a difference.
  EXPECT_LT(10 * mixed[1], 11 * in_order[1]);
  // A flat cloud. Its heights have the largest numbers, but must not separate neighbours.
  std::mt19937_64 random(3);
  std::vector<PushedBlock> cloud;
  for (int tile = 0; tile < 400; ++tile) {
    PushedBlock& block = cloud.emplace_back();
    for (int i = 0; i < 400; ++i) {
      const double x = tile % 20 + uniform(random), y = tile / 20 + uniform(random);
      block.positions.push_back(
          {x / 1000, y / 1000, 1000 * (x + std::sin(y)) + 9 * uniform(random)});
    }
  }
  const auto flat = write("cloud", testing::cloud_schema(), reordered(cloud, 10));
  EXPECT_LT(3 * flat[1], 2 * flat[0]);
}

}  // namespace
}  // namespace terrace::stream
