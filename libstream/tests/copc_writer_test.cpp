// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <random>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "format/copc/octree_builder.hpp"
#include "octree_testing.hpp"
#include "point_files.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;
using Place = std::array<std::int32_t, 3>;

constexpr std::int32_t kCubeSide = 1 << 16;

/// A node and its points as written.
struct BuiltNode {
  OctreeNode node{};
  std::vector<std::pair<Place, std::uint32_t>> points{};  ///< with the number of each

  bool operator==(const BuiltNode& other) const {
    return key_of(node) == key_of(other.node) && points == other.points;
  }
};

/// Builds the octree of places in a cube with a side of kCubeSide steps and its corner at 0.
std::vector<BuiltNode> build_nodes(const std::vector<Place>& places, std::size_t batch_records,
                                   unsigned threads = 1) {
  constexpr std::size_t kRecord = 16;
  OctreeBuilder builder("synthetic", {}, kRecord, batch_records, std::uint64_t{1} << 24, threads);
  std::vector<std::byte> records;
  for (std::size_t i = 0; i < places.size(); ++i) {
    append_values(records, places[i][0], places[i][1], places[i][2], static_cast<std::uint32_t>(i));
  }
  builder.add(records);
  const double half = kCubeSide / 2.0;
  const Octree octree{.centre = {half, half, half}, .half_size = half, .spacing = 1, .nodes = {}};
  std::vector<BuiltNode> nodes;
  builder.build(octree, Lattice{}, [&](const OctreeNode& node, std::span<const std::byte> bytes) {
    EXPECT_EQ(bytes.size(), node.points * kRecord);
    BuiltNode& built = nodes.emplace_back(BuiltNode{.node = node});
    for (std::size_t at = 0; at < bytes.size(); at += kRecord) {
      auto& [place, number] = built.points.emplace_back();
      std::memcpy(place.data(), bytes.data() + at, 12);
      std::memcpy(&number, bytes.data() + at + 12, 4);
    }
  });
  return nodes;
}

Place cell_of(const Place& place, unsigned depth, unsigned bits) {
  // Cells at that depth: kCubeSide / (2^depth * 2^bits) steps along a side.
  const double cells = std::ldexp(1.0, static_cast<int>(depth + bits)) / kCubeSide;
  Place cell{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    cell[axis] = static_cast<std::int32_t>(place[axis] * cells);
  }
  return cell;
}

/// Checks what the builder promises, and returns the nodes.
std::vector<BuiltNode> expect_octree(const std::vector<Place>& places) {
  const std::vector<BuiltNode> nodes = build_nodes(places, std::size_t{1} << 19);
  EXPECT_TRUE(nodes == build_nodes(places, 1)) << "memory makes a difference";
  EXPECT_TRUE(nodes == build_nodes(places, std::size_t{1} << 19, 5)) << "threads make a difference";
  EXPECT_TRUE(nodes == build_nodes(places, 1, 3)) << "both make a difference";

  std::vector<bool> found_numbers(places.size());
  std::set<std::string> names;
  for (const BuiltNode& node : nodes) {
    EXPECT_TRUE(names.insert(key_of(node.node)).second);
    std::uint32_t last = 0;
    for (const auto& [place, number] : node.points) {
      EXPECT_FALSE(found_numbers[number]);
      found_numbers[number] = true;
      EXPECT_EQ(place, places[number]);
      EXPECT_GE(number, last) << "not in the order in which they came";
      last = number;
      const Place in = cell_of(place, node.node.depth, 0);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(static_cast<std::uint32_t>(in[axis]), node.node.position[axis]);
      }
    }
  }
  EXPECT_EQ(std::count(found_numbers.begin(), found_numbers.end(), true),
            std::ssize(found_numbers));

  // Leaves are the nodes with few points in their cube, not counting those promoted to parents.
  unsigned depths = 0;
  for (const BuiltNode& node : nodes) depths = std::max(depths, node.node.depth + 1);
  for (unsigned depth = 0; depth < depths; ++depth) {
    std::map<Place, std::size_t> in_cubes;
    for (const Place& place : places) ++in_cubes[cell_of(place, depth, 0)];
    std::map<Place, std::size_t> cell_counts;  // points of each cell in nodes down to this depth
    std::set<Place> all, leaves;
    for (const BuiltNode& node : nodes) {
      const Place at{static_cast<std::int32_t>(node.node.position[0]),
                     static_cast<std::int32_t>(node.node.position[1]),
                     static_cast<std::int32_t>(node.node.position[2])};
      if (node.node.depth == depth && in_cubes[at] <= OctreeBuilder::kLeafPoints) leaves.insert(at);
    }
    for (const BuiltNode& node : nodes) {
      for (const auto& [place, number] : node.points) {
        const Place cube = cell_of(place, depth, 0);
        if (in_cubes[cube] <= OctreeBuilder::kLeafPoints) {
          EXPECT_LE(node.node.depth, depth) << "below a leaf";
          continue;
        }
        const Place cell = cell_of(place, depth, 7);
        all.insert(cell);
        if (node.node.depth <= depth) ++cell_counts[cell];
      }
    }
    // Each cell of the other nodes has exactly one point.
    EXPECT_EQ(cell_counts.size(), all.size()) << "depth " << depth;
    for (const auto& [cell, count] : cell_counts) EXPECT_EQ(count, 1u);
  }
  return nodes;
}

TEST(OctreeBuilder, SurfacesAreEvenAtEachDepth) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> part(0, 1);
  std::vector<Place> places;
  for (int i = 0; i < 150'000; ++i) {
    // Denser in one corner.
    const double x = std::pow(part(random), 2), y = part(random);
    const double z = 0.5 + 0.1 * std::sin(7 * x) * std::cos(5 * y);
    places.push_back({static_cast<std::int32_t>(x * kCubeSide),
                      static_cast<std::int32_t>(y * kCubeSide),
                      static_cast<std::int32_t>(z * kCubeSide)});
  }
  const std::vector<BuiltNode> nodes = expect_octree(places);
  EXPECT_GT(nodes.size(), 10u);
  // The last is the root, the coarsest part.
  EXPECT_EQ(key_of(nodes.back().node), "0-0-0-0");
}

TEST(OctreeBuilder, KeepsFewPointsInOneNode) {
  EXPECT_TRUE(build_nodes({}, 1).empty());
  const std::vector<BuiltNode> nodes = expect_octree({{0, 0, 0}, {0, 0, 0}, {kCubeSide - 1, 5, 7}});
  ASSERT_EQ(nodes.size(), 1u);
  EXPECT_EQ(nodes[0].points.size(), 3u);
}

TEST(OctreeBuilder, PointsInOnePlaceEndAtTheDeepestNode) {
  std::vector<Place> places(40'000, Place{7, 8, 9});
  for (int i = 0; i < 1000; ++i) places.push_back({i * 3, i * 5, i});
  const std::vector<BuiltNode> nodes = build_nodes(places, 1);
  EXPECT_TRUE(nodes == build_nodes(places, std::size_t{1} << 19));
  EXPECT_TRUE(nodes == build_nodes(places, 1, 3));
  std::size_t node_points = 0, largest = 0;
  for (const BuiltNode& node : nodes) {
    node_points += node.points.size();
    largest = std::max(largest, node.points.size());
  }
  EXPECT_EQ(node_points, places.size());
  EXPECT_GT(largest, 39'000u);
}

TEST(OctreeBuilder, RejectsTooManyPointsInOnePlace) {
  constexpr std::uint64_t kMax = 50'000;
  const auto build = [](std::uint64_t points) {
    OctreeBuilder builder("synthetic", {}, 12, 1, kMax);
    builder.add(std::vector<std::byte>(12 * points));
    const Octree octree{.centre = {1, 1, 1}, .half_size = 1, .spacing = 1, .nodes = {}};
    std::uint64_t written = 0;
    builder.build(octree, Lattice{}, [&](const OctreeNode& node, std::span<const std::byte>) {
      written += node.points;
    });
    return written;
  };
  EXPECT_EQ(build(kMax), kMax);
  EXPECT_NE(error_of([&] { build(kMax + 1); }).find("50001 points are in one place"),
            std::string::npos);
}

TEST(OctreeBuilder, BoundsNodesOfCloudsThatFillSpace) {
  std::mt19937_64 random(5);
  std::vector<Place> places;
  for (int i = 0; i < 400'000; ++i) {
    Place& place = places.emplace_back();
    for (std::int32_t& coordinate : place) {
      coordinate = static_cast<std::int32_t>(random() % kCubeSide);
    }
  }
  const std::vector<BuiltNode> nodes = build_nodes(places, std::size_t{1} << 19);
  EXPECT_TRUE(nodes == build_nodes(places, 1));
  std::size_t node_points = 0;
  for (const BuiltNode& node : nodes) node_points += node.points.size();
  EXPECT_EQ(node_points, places.size());
  EXPECT_EQ(nodes.back().points.size(), 8 * OctreeBuilder::kMaxPromoted);
}

/// All points of a source, written as COPC.
std::string write_copc(const std::string& path, const AllPoints& all, std::size_t block = 5000,
                       unsigned threads = 1) {
  PointHeader header{.attributes = all.info.attributes};
  header.crs = [&all] { return all.info.crs; };
  header.lattice = lattice_of(all.info);
  const auto writer = open_point_writer(path, header, {.replace = true, .threads = threads});
  const std::size_t bytes = all.info.payload_size();
  for (std::size_t at = 0; at < all.points.size(); at += block) {
    const std::size_t count = std::min(block, all.points.size() - at);
    PointBlock part;
    const auto first = all.points.positions.begin() + static_cast<std::ptrdiff_t>(at);
    part.positions.assign(first, first + static_cast<std::ptrdiff_t>(count));
    const std::byte* const payload = all.points.payload.data() + at * bytes;
    part.payload.assign(payload, payload + count * bytes);
    to_world(all.info, part);
    writer->append(part);
  }
  writer->finish();
  EXPECT_EQ(writer->points(), all.points.size());
  EXPECT_EQ(writer->rounding(), 0);
  return path;
}

AllPoints made_scan(std::size_t points, std::vector<Channel> attributes) {
  AllPoints all;
  all.info.attributes = std::move(attributes);
  for (std::size_t axis = 0; axis < 3; ++axis) all.info.coordinates[axis].type = ScalarType::i32;
  all.info.world.xy = {0.01, 0, 400'000, 0, 0.01, 5'000'000};
  all.info.coordinates[2].scale = 0.001;
  std::mt19937_64 random(7);
  for (std::size_t i = 0; i < points; ++i) {
    const auto x = static_cast<double>(random() % 20'000), y = static_cast<double>(random() % 9000);
    all.points.positions.push_back({x, y, std::round(3000 + 0.1 * x)});
    for (const Channel& channel : all.info.attributes) {
      if (channel.name == "return_number" || channel.name == "number_of_returns") {
        append_values(all.points.payload, static_cast<std::uint8_t>(1 + random() % 15));
      } else {
        append_any(all.points.payload, channel.type, random);
      }
    }
  }
  return all;
}

std::vector<Channel> attributes_of_format(const fs::path& folder, unsigned format) {
  // Attributes as the reader names them, from a file with one point.
  AllPoints one = made_scan(1, {});
  if (format >= 7) {
    for (const char* name : {"red", "green", "blue"}) {
      one.info.attributes.push_back({.name = name, .type = ScalarType::u16});
    }
  }
  if (format == 8) one.info.attributes.push_back({.name = "nir", .type = ScalarType::u16});
  one.info.attributes.push_back({.name = "own", .type = ScalarType::f32});
  one.points.payload.resize(one.info.payload_size());
  return read_file(write_copc((folder / "one.copc.laz").string(), one)).info.attributes;
}

TEST(CopcWriter, OctreesHaveTheRecordsThatWereWritten) {
  const TempFolder folder;
  for (const unsigned format : {6u, 7u, 8u}) {
    std::vector<Channel> attributes = attributes_of_format(folder.path(), format);
    // Bit fields are tested with LAS.
    std::erase_if(attributes, [](const Channel& c) {
      return c.type == ScalarType::u8 && c.name != "return_number" && c.name != "classification";
    });
    const AllPoints all = made_scan(50'000, attributes);
    const std::string file = write_copc((folder.path() / "a.copc.laz").string(), all);
    SourceOptions selection_options;
    selection_options.selection.keep.emplace();
    for (const Channel& c : attributes) selection_options.selection.keep->push_back(c.name);
    const AllPoints copy = read_file(file, selection_options);
    EXPECT_EQ(copy.info.format, "copc");
    EXPECT_EQ(copy.info.attributes, attributes);
    EXPECT_TRUE(copy.info.comments.empty());
    EXPECT_GT(copy.info.octree->nodes, 2u);
    EXPECT_TRUE(records(copy) == records(all));
    // The point format.
    EXPECT_EQ(static_cast<unsigned char>(read_text(file)[104]), 0x80u | format);
    const AllPoints whole = read_file(file);
    expect_parts_of_regions({file}, whole);
    expect_coarser_parts(file);
    // The same points give the same bytes, whatever the blocks and threads.
    write_copc((folder.path() / "b.copc.laz").string(), all, 777, format);
    EXPECT_TRUE(read_text(file) == read_text(folder.path() / "b.copc.laz"));
  }
}

TEST(CopcWriter, WritesFilesWithZeroAndOnePoints) {
  const TempFolder folder;
  for (const std::size_t points : {0u, 1u}) {
    const AllPoints all = made_scan(points, {});
    const std::string file = write_copc((folder.path() / "few.copc.laz").string(), all);
    const AllPoints copy = read_file(file);
    EXPECT_EQ(copy.info.format, "copc");
    EXPECT_TRUE(copy.info.comments.empty());
    EXPECT_TRUE(copy.points.positions == all.points.positions);
  }
}

TEST(CopcWriter, ConvertsRanksToAngles) {
  const TempFolder folder;
  AllPoints all = made_scan(255, {{.name = "scan_angle_rank", .type = ScalarType::i8}});
  for (std::size_t i = 0; i < 255; ++i) all.points.payload[i] = static_cast<std::byte>(i - 127);
  const AllPoints copy = read_file(write_copc((folder.path() / "a.copc.laz").string(), all));
  const auto& attributes = copy.info.attributes;
  const auto angle = std::find_if(attributes.begin(), attributes.end(),
                                  [](const Channel& c) { return c.name == "scan_angle"; });
  ASSERT_NE(angle, attributes.end());
  const auto angles =
      copy.values<std::int16_t>(static_cast<std::size_t>(angle - attributes.begin()));
  for (std::size_t i = 0; i < 255; ++i) {
    EXPECT_EQ(std::round(angles[i] * 0.006), static_cast<double>(i) - 127);
  }
}

TEST(CopcWriter, LeavesNothingOfAnUnfinishedFile) {
  const TempFolder folder;
  {
    const auto writer = open_point_writer((folder.path() / "a.copc.laz").string(), {});
    PointBlock block;
    block.positions.assign(100, {1, 2, 3});
    writer->append(block);
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
  EXPECT_NE(error_of([&] { open_point_writer("-", {}, {.format = "copc"}); }).find("to a pipe"),
            std::string::npos);
}

class CopcCopies : public ::testing::TestWithParam<const char*> {};

TEST_P(CopcCopies, HaveTheRecordsOfTheScan) {
  const char* const data = std::getenv("TERRACE_DATA");
  if (data == nullptr) GTEST_SKIP() << "no TERRACE_DATA";
  const TempFolder folder;
  const AllPoints all = read_file(fs::path(data) / "lidar" / GetParam());
  const std::string file = write_copc((folder.path() / "copy.copc.laz").string(), all);
  const AllPoints copy = read_file(file);
  EXPECT_EQ(copy.info.format, "copc");
  EXPECT_EQ(copy.info.attributes, all.info.attributes);
  EXPECT_TRUE(records(copy) == records(all));
  expect_coarser_parts(file);
}

INSTANTIATE_TEST_SUITE_P(Lidar, CopcCopies,
                         ::testing::Values("1.2-with-color.copc.laz", "lasrs_autzen.copc.laz",
                                           "lone-star.copc.laz", "test1_4.las"));

}  // namespace
}  // namespace terrace::stream
