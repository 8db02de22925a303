// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/point_writer.hpp"

#include <cstddef>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "point_files.hpp"

namespace terrace::stream {
namespace {

const PointHeader kHeader{.attributes = {{.name = "intensity", .type = ScalarType::u16},
                                         {.name = "classification", .type = ScalarType::u8},
                                         {.name = "reflectance", .type = ScalarType::f32}}};

std::vector<PointBlock> random_blocks(std::size_t count) {
  std::mt19937_64 random(7);
  std::vector<PointBlock> blocks(count);
  for (PointBlock& block : blocks) {
    for (std::size_t n = random() % 3000; n > 0; --n) {
      const auto coordinate = [&] { return static_cast<double>(random() % 1000000) * 0.01; };
      block.positions.push_back({coordinate(), coordinate(), coordinate()});
      append_values(block.payload, static_cast<std::uint16_t>(random()),
                    static_cast<std::uint8_t>(random() % 20), static_cast<float>(random() % 1000));
    }
  }
  return blocks;
}

// Includes formats that take their lattice from the first points.
TEST(PointWriter, ThreadsDoNotChangeTheFile) {
  const TempFolder folder;
  const std::vector<PointBlock> blocks = random_blocks(40);
  for (const std::string ending : {"xyz", "csv", "ply", "las", "laz", "copc.laz"}) {
    SCOPED_TRACE(ending);
    const std::string one = (folder.path() / ("one." + ending)).string();
    const std::string many = (folder.path() / ("many." + ending)).string();
    const auto alone = open_point_writer(one, kHeader);
    for (const PointBlock& block : blocks) alone->append(block);
    alone->finish();

    const auto writer = open_point_writer(many, kHeader);
    std::vector<PointWriter::EncodedPtr> encoded(blocks.size());
    for (std::size_t done = 0; done < blocks.size(); done += 10) {  // encode while others append
      std::vector<std::jthread> threads;
      for (std::size_t first = done; first < done + 2; ++first) {
        threads.emplace_back([&, first] {
          for (std::size_t i = first; i < done + 10; i += 2) encoded[i] = writer->encode(blocks[i]);
        });
      }
      for (std::size_t i = done - std::min<std::size_t>(done, 10); i < done; ++i) {
        writer->append(std::move(encoded[i]));
      }
    }
    for (std::size_t i = blocks.size() - 10; i < blocks.size(); ++i) {
      writer->append(std::move(encoded[i]));
    }
    writer->finish();
    EXPECT_EQ(writer->points(), alone->points());
    EXPECT_EQ(writer->rounding(), alone->rounding());
    EXPECT_TRUE(read_text(one) == read_text(many));
  }
}

TEST(PointWriter, ReportsTheNumberOfAPointThatDoesNotFit) {
  const TempFolder folder;
  const PointHeader header{.lattice = Lattice{.scale = {0.01, 0.01, 0.01}, .offset = {}}};
  for (const std::string ending : {"las", "laz", "copc.laz"}) {
    const auto writer = open_point_writer((folder.path() / ("a." + ending)).string(), header);
    const PointBlock good{.positions = std::vector<Point3>(100, Point3{1, 2, 3}), .payload = {}};
    PointBlock bad = good;
    bad.positions[23][1] = 1e9;
    auto first = writer->encode(good), second = writer->encode(bad);
    writer->append(std::move(first));
    EXPECT_NE(error_of([&] { writer->append(std::move(second)); }).find("point 123"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace terrace::stream
