// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "format/copc/hierarchy.hpp"
#include "io/bytes.hpp"
#include "las_files.hpp"
#include "octree_testing.hpp"
#include "point_files.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {
namespace {

/// Offsets of the pages and of the first chunk in the files made here.
constexpr std::uint64_t kFirstChunk = 100, kFirstPage = 1000;

struct HierarchyEntry {
  std::int32_t depth = 0, x = 0, y = 0, z = 0;
  std::uint64_t offset = 0;
  std::int32_t bytes = 0, points = 0;
};

std::string page_of(const std::vector<HierarchyEntry>& entries) {
  std::string page(entries.size() * 32, '\0');
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const HierarchyEntry& e = entries[i];
    const std::array<std::int32_t, 4> key{e.depth, e.x, e.y, e.z};
    std::memcpy(page.data() + 32 * i, key.data(), 16);
    put(page, 32 * i + 16, e.offset);
    put(page, 32 * i + 24, e.bytes);
    put(page, 32 * i + 28, e.points);
  }
  return page;
}

std::string info_of(std::uint64_t page_bytes, double half_size = 8, double spacing = 1) {
  std::string info(160, '\0');
  put(info, 24, half_size);
  put(info, 32, spacing);
  put(info, 40, kFirstPage);
  put(info, 48, page_bytes);
  return info;
}

/// Returns the octree of a file with these consecutive pages.
Octree octree_of(const std::vector<std::vector<HierarchyEntry>>& pages, std::uint64_t points,
                 const std::string& info = {}) {
  std::string file(kFirstPage, '\0');
  for (const std::vector<HierarchyEntry>& page : pages) file += page_of(page);
  std::vector<std::byte> bytes(file.size());
  std::memcpy(bytes.data(), file.data(), file.size());
  const auto source = bytes_in_memory("synthetic", std::move(bytes));
  return read_copc_hierarchy(*source, info.empty() ? info_of(pages.front().size() * 32) : info,
                             kFirstChunk, points);
}

std::string refusal_of(const std::vector<std::vector<HierarchyEntry>>& pages, std::uint64_t points,
                       const std::string& info = {}) {
  return error_of([&] { static_cast<void>(octree_of(pages, points, info)); });
}

/// A random subtree of a node, with consecutive points beginning at `offset`.
void grow(std::mt19937_64& random, Octree& octree, const OctreeNode& node, std::uint64_t& offset) {
  OctreeNode& here = octree.nodes.emplace_back(node);
  here.points = node.depth == 0 || random() % 8 == 0 ? 0 : 1 + random() % 9;
  if (here.points > 0) {
    here.offset = offset;
    here.bytes = 1 + random() % 30;
    offset += here.bytes;
  }
  for (std::uint32_t child = 0; child < 8 && node.depth < 7; ++child) {
    if (random() % 100 >= 48 + 20 / (node.depth + 1)) continue;
    OctreeNode next{.depth = node.depth + 1};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      next.position[axis] = 2 * node.position[axis] + (child >> axis & 1);
    }
    grow(random, octree, next, offset);
  }
}

TEST(CopcHierarchy, PagesContainAllNodesAndAreBounded) {
  constexpr std::uint64_t kSeed = 3;
  std::cout << "seed " << kSeed << '\n';
  std::mt19937_64 random(kSeed);
  std::size_t max_pages = 0;
  for (int round = 0; round < 40 / TERRACE_TEST_SHARE; ++round) {
    SCOPED_TRACE(round);
    Octree octree{.centre = {}, .half_size = 8, .spacing = 1, .nodes = {}};
    std::uint64_t offset = kFirstChunk;
    grow(random, octree, {}, offset);
    ASSERT_EQ(octree.arrange(), nullptr);
    const std::size_t page_nodes = std::size_t{1} << (4 + random() % 8);
    const CopcHierarchy written = write_copc_hierarchy(octree, offset, page_nodes);

    std::vector<std::byte> bytes(offset);
    for (const char c : written.bytes) bytes.push_back(static_cast<std::byte>(c));
    std::string info = info_of(written.root_bytes);
    put(info, 40, offset);
    const auto file = bytes_in_memory("synthetic", std::move(bytes));
    const Octree read = read_copc_hierarchy(*file, info, kFirstChunk, octree.points());
    std::vector<OctreeNode> with_points = octree.nodes;
    std::erase_if(with_points, [](const OctreeNode& node) { return node.points == 0; });
    ASSERT_EQ(read.nodes.size(), with_points.size());
    for (std::size_t i = 0; i < with_points.size(); ++i) {
      ASSERT_EQ(key_of(read.nodes[i]), key_of(with_points[i]));
      ASSERT_EQ(read.nodes[i].offset, with_points[i].offset);
      ASSERT_EQ(read.nodes[i].bytes, with_points[i].bytes);
      ASSERT_EQ(read.nodes[i].points, with_points[i].points);
    }
    // The pages after the root page are complete and consecutive.
    std::uint64_t next = offset + written.root_bytes;
    std::size_t pages = 0;
    for (std::size_t at = 0; at < written.root_bytes; at += 32) {
      const char* const entry = written.bytes.data() + at;
      if (load_little_endian<std::int32_t>(entry + 28) != -1) continue;
      const auto page_bytes = load_little_endian<std::int32_t>(entry + 24);
      EXPECT_EQ(load_little_endian<std::uint64_t>(entry + 16), next);
      EXPECT_LE(page_bytes, static_cast<std::int32_t>(32 * page_nodes));
      EXPECT_EQ(std::string_view(entry, 16),
                std::string_view(written.bytes).substr(next - offset, 16));
      next += static_cast<std::uint64_t>(page_bytes);
      ++pages;
    }
    EXPECT_EQ(next, offset + written.bytes.size());
    EXPECT_EQ(pages == 0, octree.nodes.size() <= page_nodes);
    EXPECT_EQ(written.bytes.size(), 32 * (octree.nodes.size() + pages));
    max_pages = std::max(max_pages, pages);
  }
  EXPECT_GT(max_pages, 100u);
}

TEST(CopcOctree, NodesComeDepthFirstInMortonOrder) {
  // The second page begins after the four entries of the first.
  const Octree octree = octree_of({{{1, 1, 0, 0, 120, 10, 3},
                                    {0, 0, 0, 0, 110, 10, 2},
                                    {1, 0, 0, 1, 0, 0, 0},
                                    {1, 0, 1, 0, kFirstPage + 128, 64, -1}},
                                   {{1, 0, 1, 0, 130, 10, 4}, {2, 3, 1, 0, 140, 10, 5}}},
                                  14);
  std::vector<std::uint64_t> points;
  for (const OctreeNode& node : octree.nodes) points.push_back(node.points);
  EXPECT_EQ(points, (std::vector<std::uint64_t>{2, 3, 5, 4}));
  const Box3 box = octree.box(octree.nodes[2]);
  EXPECT_EQ(box.min, (Point3{4, -4, -8}));
  EXPECT_EQ(box.max, (Point3{8, 0, -4}));
}

TEST(CopcOctree, KeepsNodesInTheRegionDownToTheResolution) {
  const auto node_count = [](const std::optional<Box3>& region, double resolution) {
    Octree octree = octree_of({{{0, 0, 0, 0, 110, 10, 1},
                                {1, 0, 0, 0, 120, 10, 2},
                                {1, 1, 1, 1, 130, 10, 4},
                                {2, 3, 3, 3, 140, 10, 8}}},
                              15);
    octree.keep(region, resolution, {0.01, 0.01, 0.01});
    std::uint64_t points = 0;
    for (const OctreeNode& node : octree.nodes) points += node.points;
    return points;
  };
  EXPECT_EQ(node_count({}, 0), 15u);
  EXPECT_EQ(node_count({}, 2), 1u);
  EXPECT_EQ(node_count({}, 1), 1u);
  EXPECT_EQ(node_count({}, 0.9), 7u);
  EXPECT_EQ(node_count({}, 0.3), 15u);
  EXPECT_EQ(node_count({}, 0.01), 15u);
  EXPECT_EQ(node_count(Box3{{5, 5, -kInfinity}, {6, 6, kInfinity}}, 0), 13u);
  EXPECT_EQ(node_count(Box3{{5, 5, -7}, {6, 6, -6}}, 0), 1u);
  EXPECT_EQ(node_count(Box3{{5, 5, -kInfinity}, {6, 6, kInfinity}}, 0.5), 5u);
  // A cube's points may be rounded across its sides.
  EXPECT_EQ(node_count(Box3{{-1, -1, -1}, {-0.005, -0.005, -0.005}}, 0), 7u);
  // The root is read for any region, because its points check its cube.
  EXPECT_EQ(node_count(Box3{{9, 9, 9}, {10, 10, 10}}, 0), 1u);
}

TEST(CopcOctree, RejectsInvalidHierarchies) {
  const HierarchyEntry root{0, 0, 0, 0, 110, 10, 1};
  const auto has = [](const std::string& text, std::string_view part) {
    return text.find(part) != text.npos;
  };
  EXPECT_EQ(refusal_of({{root}}, 1), "");
  EXPECT_PRED2(has, refusal_of({{root}}, 2), "have 1 point, but the header promises 2");
  EXPECT_PRED2(has, refusal_of({{root, {0, 0, 0, 0, 120, 10, 1}}}, 2), "is listed twice");
  EXPECT_PRED2(has, refusal_of({{root, {1, 0, 0, 0, 119, 10, 1}}}, 2), "share points");
  EXPECT_PRED2(has, refusal_of({{{-1, 0, 0, 0, 110, 10, 1}}}, 1), "has depth -1");
  EXPECT_PRED2(has, refusal_of({{{31, 0, 0, 0, 110, 10, 1}}}, 1), "has depth 31");
  EXPECT_PRED2(has, refusal_of({{{1, 2, 0, 0, 110, 10, 1}}}, 1), "outside its root");
  EXPECT_PRED2(has, refusal_of({{{1, 0, -1, 0, 110, 10, 1}}}, 1), "outside its root");
  EXPECT_PRED2(has, refusal_of({{{0, 0, 0, 0, 110, -10, 1}}}, 1), "negative size");
  EXPECT_PRED2(has, refusal_of({{{0, 0, 0, 0, 110, 10, -2}}}, 1), "negative size");
  EXPECT_PRED2(has, refusal_of({{{0, 0, 0, 0, 99, 10, 1}}}, 1), "are outside the file");
  EXPECT_PRED2(has, refusal_of({{{0, 0, 0, 0, 1030, 10, 1}}}, 1), "are outside the file");
  EXPECT_PRED2(has, refusal_of({{{0, 0, 0, 0, ~0ULL, 10, 1}}}, 1), "are outside the file");
  EXPECT_PRED2(has, refusal_of({{{0, 0, 0, 0, 110, 0, 1}}}, 1), "are outside the file");
  // Pages that are outside the file, circular, overlapping and larger than the file in total, or
  // that end within an entry.
  EXPECT_PRED2(has, refusal_of({{{1, 0, 0, 0, 2000, 32, -1}}}, 1), "is outside the file");
  EXPECT_PRED2(has, refusal_of({{{1, 0, 0, 0, kFirstPage, 32, -1}}}, 1), "referred to twice");
  EXPECT_PRED2(has, refusal_of({{{1, 0, 0, 0, 0, 992, -1}, {1, 0, 0, 1, 8, 992, -1}}}, 1),
               "referred to twice");
  EXPECT_PRED2(has, refusal_of({{{1, 0, 0, 0, 0, 31, -1}}}, 1), "is outside the file");
  EXPECT_PRED2(has, refusal_of({{root}}, 1, info_of(64)), "is outside the file");
  EXPECT_PRED2(has, refusal_of({{root}}, 1, info_of(32, 0)), "not a positive number");
  EXPECT_PRED2(has, refusal_of({{root}}, 1, info_of(32, 1, -1)), "not a positive number");
  EXPECT_PRED2(has, refusal_of({{root}}, 1, info_of(32).substr(1)), "truncated");
}

/// With a misplaced cube, a region would lose all its points.
TEST(CopcOctree, RejectsRegionsIfTheCubeIsWrong) {
  const TempFolder folder;
  const std::string path = (folder.path() / "cube.copc.laz").string();
  PointBlock points;
  for (int i = 0; i < 1000; ++i)
    points.positions.push_back({i * 0.5, 1.0 * (i % 7), 1.0 * (i % 11)});
  const auto writer = open_point_writer(path, {});
  writer->append(points);
  writer->finish();
  SourceOptions options;
  options.selection.region = Box3{{100, 0, -kInfinity}, {200, 7, kInfinity}};
  EXPECT_EQ(read_file(path, options).points.size(), 201u);

  std::string bytes = read_text(path);
  constexpr std::size_t kCentreX = 375 + 54;
  put(bytes, kCentreX, load_little_endian<double>(bytes.data() + kCentreX) - 1e6);
  write_text(path, bytes);
  EXPECT_EQ(read_file(path).points.size(), 1000u);
  for (const unsigned threads : {1u, 3u}) {
    options.threads = threads;
    const std::string error = error_of([&] { read_file(path, options); });
    EXPECT_NE(error.find("node 0-0-0-0: has a point outside its cube"), std::string::npos) << error;
  }
}

class CopcFiles : public ::testing::TestWithParam<const char*> {};

/// The oracle is the same file with another user name in its VLR, which is a normal LAZ file.
TEST_P(CopcFiles, RegionsHaveTheSamePointsAsTheWholeFile) {
  const char* const data = std::getenv("TERRACE_DATA");
  if (data == nullptr) GTEST_SKIP() << "no TERRACE_DATA";
  const std::filesystem::path file = std::filesystem::path(data) / "lidar" / GetParam();
  const TempFolder folder;
  std::string bytes = read_text(file);
  ASSERT_EQ(bytes.substr(377, 4), "copc");
  bytes[377] = 'x';
  const std::string plain = write_text(folder.path() / "plain.laz", bytes);
  const AllPoints all = read_file(plain);
  EXPECT_EQ(all.info.format, "laz");
  EXPECT_FALSE(all.info.octree);

  const AllPoints by_nodes = read_file(file);
  EXPECT_EQ(by_nodes.info.format, "copc");
  EXPECT_TRUE(by_nodes.info.octree);
  EXPECT_EQ(by_nodes.info.points, all.points.size());
  EXPECT_TRUE(records(by_nodes, kEverywhere) == records(all, kEverywhere));

  expect_parts_of_regions({file.string(), plain}, all);
  // Because it has no octree.
  SourceOptions coarse;
  coarse.selection.resolution = 1;
  EXPECT_NE(error_of([&] { read_file(plain, coarse); }).find("name a COPC file"),
            std::string::npos);
}

TEST_P(CopcFiles, CoarserResolutionsAreSubsets) {
  const char* const data = std::getenv("TERRACE_DATA");
  if (data == nullptr) GTEST_SKIP() << "no TERRACE_DATA";
  expect_coarser_parts((std::filesystem::path(data) / "lidar" / GetParam()).string());
}

/// Programs that copy the VLRs of COPC to other points leave a hierarchy that is wrong.
TEST_P(CopcFiles, ReadAsLazIfTheHierarchyIsDamaged) {
  const char* const data = std::getenv("TERRACE_DATA");
  if (data == nullptr) GTEST_SKIP() << "no TERRACE_DATA";
  const std::filesystem::path file = std::filesystem::path(data) / "lidar" / GetParam();
  const TempFolder folder;
  std::string bytes = read_text(file);
  put(bytes, 375 + 54 + 40, ~std::uint64_t{0});
  const std::string damaged = write_text(folder.path() / "damaged.laz", bytes);
  const AllPoints as_laz = read_file(damaged);
  EXPECT_EQ(as_laz.info.format, "laz");
  ASSERT_FALSE(as_laz.info.comments.empty());
  EXPECT_NE(as_laz.info.comments.back().find("in the order of the file"), std::string::npos);
  EXPECT_TRUE(records(as_laz, kEverywhere) == records(read_file(file), kEverywhere));
  SourceOptions coarse;
  coarse.selection.resolution = 1;
  EXPECT_NE(error_of([&] { read_file(damaged, coarse); }).find("hierarchy"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Lidar, CopcFiles,
                         ::testing::Values("1.2-with-color.copc.laz", "lasrs_autzen.copc.laz",
                                           "lone-star.copc.laz"));

}  // namespace
}  // namespace terrace::stream
