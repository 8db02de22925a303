// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "stand_in_hierarchy.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/store.hpp"

/// Shared by the tests of the store: inputs of many kinds and the round-trip check.

namespace terrace::stream::testing {

inline constexpr std::array kAllTypes{
    ScalarType::i8,  ScalarType::u8,  ScalarType::i16, ScalarType::u16, ScalarType::i32,
    ScalarType::u32, ScalarType::i64, ScalarType::u64, ScalarType::f32, ScalarType::f64};

inline std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

inline double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

inline Channel channel(std::string name, ScalarType type = ScalarType::f64) {
  return {std::move(name), type, 1.0, 0.0, {}};
}

inline StoreSchema grid_schema(ScalarType type) {
  StoreSchema schema;
  schema.grid = true;
  schema.coordinates = {
      channel("column", ScalarType::i32), channel("row", ScalarType::i32),
      Channel{.name = "height", .type = type, .scale = 0.5, .offset = 3, .unit = "metre"}};
  schema.columns = schema.rows = std::uint64_t{1} << 31;
  schema.world.xy = {30, 0, 500000.25, 0, -30, 5e6};
  schema.crs = {.epsg = 32632,
                .vertical_epsg = 5773,
                .name = "UTM",
                .wkt = "",
                .geographic = false,
                .horizontal_unit = "metre",
                .vertical_unit = "metre"};
  schema.vertical = "orthometric";
  schema.format = "test";
  schema.parameters = {{"block", "10000"}, {"effort", "standard"}};
  return schema;
}

inline StoreSchema cloud_schema() {
  StoreSchema schema;
  schema.coordinates = {channel("x"), channel("y"), channel("z")};
  schema.format = "test";
  return schema;
}

struct PushedBlock {
  std::vector<Point3> positions;
  std::vector<std::byte> payload;
};

enum class ReliefKind { flat, fractal, noise, extreme, decimal };

inline double limit_low(ScalarType type) {
  switch (type) {
    case ScalarType::i8:
      return -128;
    case ScalarType::i16:
      return -32768;
    case ScalarType::i32:
      return -2147483648.0;
    case ScalarType::i64:
      return -0x1p63;
    case ScalarType::f32:
      return -std::numeric_limits<float>::max();
    case ScalarType::f64:
      return -std::numeric_limits<double>::max();
    case ScalarType::u8:
    case ScalarType::u16:
    case ScalarType::u32:
    case ScalarType::u64:
      break;
  }
  return 0;
}
inline double limit_high(ScalarType type) {
  switch (type) {
    case ScalarType::i8:
      return 127;
    case ScalarType::u8:
      return 255;
    case ScalarType::i16:
      return 32767;
    case ScalarType::u16:
      return 65535;
    case ScalarType::i32:
      return 2147483647.0;
    case ScalarType::u32:
      return 4294967295.0;
    case ScalarType::i64:
      return 0x1p63;
    case ScalarType::u64:
      return 0x1p64;
    case ScalarType::f32:
      return std::numeric_limits<float>::max();
    case ScalarType::f64:
      return std::numeric_limits<double>::max();
  }
  return 0;
}

/// Returns a raster in square tiles of at most `tile` cells per side, with a tenth of the cells
/// without data.
inline std::vector<PushedBlock> grid_blocks(ScalarType type, ReliefKind relief, int width,
                                            int height, int tile, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const bool floating = type == ScalarType::f32 || type == ScalarType::f64;
  const auto sample = [&](int x, int y) -> double {
    switch (relief) {
      case ReliefKind::flat:
        return 42;
      case ReliefKind::fractal: {
        const double h = 60 + 40 * (std::abs(x % 64 - 32) / 32.0) +
                         15 * (std::abs(y % 20 - 10) / 10.0) + 4 * uniform(random);
        return type == ScalarType::f32   ? static_cast<double>(static_cast<float>(h))
               : type == ScalarType::f64 ? h
                                         : std::floor(h);
      }
      case ReliefKind::noise:
        return static_cast<double>(random() % 128);
      case ReliefKind::extreme: {
        if (floating && random() % 7 == 0) return -0.0;
        if (type == ScalarType::f32 && random() % 7 == 0)
          return static_cast<double>(std::numeric_limits<float>::denorm_min());
        return random() % 2 == 0 ? limit_low(type) : limit_high(type);
      }
      case ReliefKind::decimal: {
        const double h = static_cast<double>(random() % 100) / 100;
        return type == ScalarType::f32   ? static_cast<double>(static_cast<float>(h))
               : type == ScalarType::f64 ? h
                                         : std::floor(h * 100);
      }
    }
    return 0;
  };
  std::vector<PushedBlock> blocks;
  for (int ty = 0; ty < height; ty += tile) {
    for (int tx = 0; tx < width; tx += tile) {
      PushedBlock block;
      for (int y = ty; y < std::min(height, ty + tile); ++y) {
        for (int x = tx; x < std::min(width, tx + tile); ++x) {
          if (random() % 10 == 0) continue;
          block.positions.push_back({static_cast<double>(x), static_cast<double>(y), sample(x, y)});
        }
      }
      blocks.push_back(std::move(block));
    }
  }
  return blocks;
}

/// lines: decimals, with each point near the previous one.
enum class CoordinateKind { decimals, floats, doubles, extremes, mixed, lines };

inline std::vector<PushedBlock> cloud_blocks(CoordinateKind kind, std::size_t points,
                                             std::size_t block_points, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<PushedBlock> blocks;
  for (std::size_t start = 0; start < points; start += block_points) {
    PushedBlock block;
    const CoordinateKind block_kind =
        kind == CoordinateKind::mixed ? static_cast<CoordinateKind>(blocks.size() % 4) : kind;
    const double origin = static_cast<double>(blocks.size() % 3) * 100;
    const auto number = [&]() -> double {
      const double u = origin + 100 * uniform(random);
      switch (block_kind) {
        case CoordinateKind::decimals:
          return std::nearbyint(u * 1000) / 1000 + 0.0;
        case CoordinateKind::floats:
          return static_cast<double>(static_cast<float>(u - 150));
        case CoordinateKind::doubles:
          return (u - 150) * uniform(random);
        case CoordinateKind::extremes:
        case CoordinateKind::mixed:
        case CoordinateKind::lines:
          break;
      }
      return std::array{-0.0, 0.0, 1e308, -1e308, 5e-324, 1.0, 0.1}[random() % 7];
    };
    for (std::size_t i = 0; i < std::min(block_points, points - start); ++i) {
      if (kind == CoordinateKind::lines) {
        const auto along = static_cast<double>(i % 50), across = static_cast<double>(i / 50);
        block.positions.push_back(
            {(origin + along) / 100, across / 8, std::floor(9 * uniform(random)) / 10});
      } else {
        block.positions.push_back({number(), number(), number()});
      }
    }
    blocks.push_back(std::move(block));
  }
  return blocks;
}

/// A multiset of points, as bit patterns with their attributes.
class PointBag {
 public:
  struct Item {
    Point3 position;
    std::vector<std::byte> payload;
  };
  PointBag() = default;
  PointBag(std::initializer_list<Item> items) {
    for (const Item& item : items) add(item.position, item.payload);
  }
  void add(const Point3& p, std::span<const std::byte> payload) {
    std::string key(sizeof p + payload.size(), '\0');
    std::memcpy(key.data(), &p, sizeof p);
    if (!payload.empty()) std::memcpy(key.data() + sizeof p, payload.data(), payload.size());
    ++counts_[key];
  }
  friend bool operator==(const PointBag&, const PointBag&) = default;

 private:
  std::map<std::string, int> counts_;
};

inline void fail_on_problem(const Problem& problem) {
  ADD_FAILURE() << problem.file << ", byte " << problem.offset << ": " << problem.what;
}

/// Returns the members of all levels, that is, every point of the store once.
inline PointBag all_points(const Store& store) {
  PointBag bag;
  const std::size_t stride = store.schema().payload_size();
  for (unsigned level = 0; level <= store.top(); ++level) {
    store.for_each(level, [&](ClusterId, const ClusterRecord&, const ClusterPoints& points) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        bag.add(points.positions[i], std::span(points.payload).subspan(i * stride, stride));
      }
    });
  }
  return bag;
}

inline std::uint64_t write_store(const std::filesystem::path& path, const StoreSchema& schema,
                                 const std::vector<PushedBlock>& blocks,
                                 const StandInHierarchy::Options& options) {
  StoreWriter writer(path, schema);
  StandInHierarchy hierarchy(writer, options);
  for (const PushedBlock& block : blocks) hierarchy.push(block.positions, block.payload);
  return hierarchy.finish();
}

/// Writes the blocks, reads them back in every way, and verifies. Returns the size of the store in
/// bytes.
inline std::uint64_t check_round_trip(const StoreSchema& schema,
                                      const std::vector<PushedBlock>& blocks,
                                      const StandInHierarchy::Options& options) {
  const TempFolder folder;
  const auto path = folder.path() / "store";
  const std::uint64_t bytes = write_store(path, schema, blocks, options);
  const Store store = Store::open(path);
  EXPECT_EQ(store.bytes(), bytes);

  PointBag expected;
  Box3 bounds;
  double sum = 0;
  std::uint64_t n = 0;
  const std::size_t stride = schema.payload_size();
  for (const PushedBlock& block : blocks) {
    for (std::size_t i = 0; i < block.positions.size(); ++i, ++n) {
      expected.add(block.positions[i], std::span(block.payload).subspan(i * stride, stride));
      bounds.include(block.positions[i]);
      sum += block.positions[i][2];
    }
  }
  EXPECT_EQ(store.points(), n);
  EXPECT_EQ(store.bounds(), bounds);
  // The sum of the largest doubles overflows.
  if (const double mean = sum / static_cast<double>(n); std::isfinite(mean)) {
    const double size = std::max(std::abs(bounds.min[2]), std::abs(bounds.max[2]));
    EXPECT_NEAR(store.mean_height(), mean, 1e-9 * size);
  }
  EXPECT_TRUE(all_points(store) == expected) << "the points differ";
  EXPECT_TRUE(store.verify(fail_on_problem));

  // Reading one by one gives the same as in sequence, and the head of a cluster equals its
  // representative.
  ClusterPoints single, head;
  for (unsigned level = 0; level <= store.top(); ++level) {
    std::uint64_t next = 0;
    store.for_each(
        level, [&](ClusterId id, const ClusterRecord& record, const ClusterPoints& points) {
          EXPECT_EQ(ordinal_of(id), next++);
          EXPECT_EQ(level_of(id), level);
          store.read(id, single);
          EXPECT_EQ(std::memcmp(single.positions.data(), points.positions.data(),
                                points.size() * sizeof(Point3)),
                    0);
          EXPECT_EQ(single.payload, points.payload);
          EXPECT_EQ(single.children, points.children);
          EXPECT_EQ(store.record(id).offset, record.offset);
          EXPECT_EQ(record.points, points.size());
          for (const Point3& p : points.positions) EXPECT_TRUE(record.summary.box.contains(p));
          for (std::size_t i = 0; i < points.size(); ++i) {
            for (unsigned j = 0; j < level; ++j) {
              store.read(cluster_id(j, points.children[i * level + j]), head);
              EXPECT_TRUE(head.has_representative);
              EXPECT_EQ(std::memcmp(&head.representative, &points.positions[i], sizeof(Point3)), 0);
            }
          }
        });
    EXPECT_EQ(next, store.levels()[level].clusters);
  }
  return bytes;
}

}  // namespace terrace::stream::testing
