// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/store.hpp"

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <random>

#include <gtest/gtest.h>

#include "stand_in_hierarchy.hpp"
#include "store_testing.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/overlay.hpp"

namespace terrace::stream {
namespace {

using testing::StandInHierarchy;
using testing::uniform;

TEST(Store, OpensAnEmptyStore) {
  const TempFolder folder;
  StoreWriter writer(folder.path() / "s", testing::grid_schema(ScalarType::i16));
  StandInHierarchy(writer, {}).finish();
  const Store store = Store::open(folder.path() / "s");
  EXPECT_EQ(store.points(), 0u);
  EXPECT_EQ(store.top(), 0u);
  EXPECT_TRUE(store.bounds().empty());
  ClusterPoints points;
  store.read(store.root(), points);
  EXPECT_EQ(points.size(), 0u);
  EXPECT_FALSE(points.has_representative);
  EXPECT_TRUE(store.record(store.root()).summary.box.empty());
  EXPECT_TRUE(store.verify(testing::fail_on_problem));
}

TEST(Store, RoundTripsOnePoint) {
  const TempFolder folder;
  StoreWriter writer(folder.path() / "s", testing::cloud_schema());
  StandInHierarchy hierarchy(writer, {});
  hierarchy.push(std::vector<Point3>{{1.5, -0.0, 1e300}});
  hierarchy.finish();
  const Store store = Store::open(folder.path() / "s");
  EXPECT_EQ(testing::all_points(store), (testing::PointBag{{{1.5, -0.0, 1e300}, {}}}));
  EXPECT_TRUE(store.verify(testing::fail_on_problem));
}

TEST(Store, ReadingEndsWhenStopped) {
  const TempFolder folder;
  StoreWriter writer(folder.path() / "s", testing::cloud_schema());
  StandInHierarchy hierarchy(writer, {});
  hierarchy.push(std::vector<Point3>{{1, 2, 3}, {4, 5, 6}});
  hierarchy.finish();
  const Store store = Store::open(folder.path() / "s");
  std::stop_source stop, other;
  const Store stopped = store.with_stop(stop.get_token());
  const Store goes_on = stopped.with_stop(other.get_token());
  const auto points = testing::all_points(store);
  EXPECT_EQ(testing::all_points(stopped), points);
  stop.request_stop();
  ClusterPoints cluster;
  EXPECT_THROW(stopped.read(stopped.root(), cluster), Stopped);
  EXPECT_THROW(static_cast<void>(stopped.record(stopped.root())), Stopped);
  EXPECT_THROW(testing::all_points(stopped), Stopped);
  EXPECT_THROW(stopped.verify(testing::fail_on_problem), Stopped);
  for (const Store* unstopped : {&store, &goes_on}) {
    EXPECT_EQ(testing::all_points(*unstopped), points);
    EXPECT_TRUE(unstopped->verify(testing::fail_on_problem));
  }
}

/// Rasters of every sample type, smooth and rough, are read back bit for bit.
TEST(Store, RoundTripsGridsBitForBit) {
  for (const ScalarType type : testing::kAllTypes) {
    for (const testing::ReliefKind relief :
         {testing::ReliefKind::flat, testing::ReliefKind::fractal, testing::ReliefKind::noise,
          testing::ReliefKind::extreme, testing::ReliefKind::decimal}) {
      SCOPED_TRACE(::testing::Message()
                   << name_of(type) << ", relief " << static_cast<int>(relief));
      testing::check_round_trip(testing::grid_schema(type),
                                testing::grid_blocks(type, relief, 96, 88, 40, 1),
                                {.block_points = 1600, .cluster_points = 40});
    }
  }
}

TEST(Store, RoundTripsGridsFarFromTheOrigin) {
  auto blocks = testing::grid_blocks(ScalarType::i16, testing::ReliefKind::fractal, 60, 60, 30, 2);
  for (auto& block : blocks) {
    for (Point3& p : block.positions) {
      p[0] += (1 << 30) - 100;
      p[1] += (1 << 30) - 100;
    }
  }
  testing::check_round_trip(testing::grid_schema(ScalarType::i16), blocks,
                            {.block_points = 900, .cluster_points = 30});
}

TEST(Store, KeepsCellsThatOccurTwice) {
  std::vector<testing::PushedBlock> blocks(3);
  std::mt19937_64 random(3);
  for (auto& block : blocks) {
    for (int i = 0; i < 500; ++i) {
      block.positions.push_back({static_cast<double>(random() % 8),
                                 static_cast<double>(random() % 8),
                                 static_cast<double>(random() % 3)});
    }
  }
  testing::check_round_trip(testing::grid_schema(ScalarType::u8), blocks,
                            {.block_points = 500, .cluster_points = 50});
  for (auto& block : blocks)
    std::fill(block.positions.begin(), block.positions.end(), Point3{7, 7, 7});
  testing::check_round_trip(testing::grid_schema(ScalarType::u8), blocks,
                            {.block_points = 500, .cluster_points = 50});
  testing::check_round_trip(testing::cloud_schema(), blocks,
                            {.block_points = 500, .cluster_points = 50});
}

TEST(Store, RoundTripsCloudsOfAllNumbersBitForBit) {
  for (const auto kind : {testing::CoordinateKind::decimals, testing::CoordinateKind::floats,
                          testing::CoordinateKind::doubles, testing::CoordinateKind::extremes,
                          testing::CoordinateKind::mixed, testing::CoordinateKind::lines}) {
    SCOPED_TRACE(static_cast<int>(kind));
    testing::check_round_trip(testing::cloud_schema(), testing::cloud_blocks(kind, 8000, 900, 4),
                              {.block_points = 900, .cluster_points = 60});
  }
}

TEST(Store, RoundTripsAttributesOfAllTypesBitForBit) {
  StoreSchema schema = testing::cloud_schema();
  for (const ScalarType type : testing::kAllTypes)
    schema.attributes.push_back(testing::channel(std::string(name_of(type)), type));
  auto blocks = testing::cloud_blocks(testing::CoordinateKind::decimals, 6000, 900, 5);
  std::mt19937_64 random(6);
  std::uint64_t row = 0;
  for (auto& block : blocks) {
    for (std::size_t i = 0; i < block.positions.size(); ++i, ++row) {
      // Constant, counting and random bytes in turn; random ones include NaNs with every payload.
      for (const Channel& channel : schema.attributes) {
        const std::uint64_t value = row < 1800 ? 0 : row < 3600 ? row : random();
        const auto* bytes = reinterpret_cast<const std::byte*>(&value);
        block.payload.insert(block.payload.end(), bytes, bytes + size_of(channel.type));
      }
    }
  }
  testing::check_round_trip(schema, blocks, {.block_points = 900, .cluster_points = 60});
}

// Typical attributes of a survey: colours that change together in fields wider than needed, pulses
// at a few intervals, a field that is never set. Random points lose the order of the lines.
TEST(Store, AttributesOfScanLinesTakeFewBytes) {
  StoreSchema schema = testing::cloud_schema();
  for (const char* colour : {"red", "green", "blue"}) {
    schema.attributes.push_back(testing::channel(colour, ScalarType::u16));
  }
  schema.attributes.push_back(testing::channel("time", ScalarType::f64));
  schema.attributes.push_back(testing::channel("unset", ScalarType::i64));
  std::array<std::uint64_t, 2> bytes{};
  for (const bool lines : {true, false}) {
    auto blocks = testing::cloud_blocks(
        lines ? testing::CoordinateKind::lines : testing::CoordinateKind::decimals, 8000, 900, 4);
    std::mt19937_64 random(5);
    double time = 3e8;
    for (auto& block : blocks) {
      for (std::size_t i = 0; i < block.positions.size(); ++i) {
        const auto put = [&](auto value) {
          const auto* begin = reinterpret_cast<const std::byte*>(&value);
          block.payload.insert(block.payload.end(), begin, begin + sizeof value);
        };
        const std::uint64_t grey = random() % 250;
        for (std::uint64_t c = 0; c < 3; ++c) put(static_cast<std::uint16_t>(257 * (grey + c)));
        time += std::array{12e-6, 13e-6, 12e-6, 0.0}[random() % 4];
        put(std::nearbyint(time * 1e6) / 1e6);
        put(std::int64_t{-5});
      }
    }
    bytes[lines ? 0 : 1] =
        testing::check_round_trip(schema, blocks, {.block_points = 900, .cluster_points = 60});
  }
  // Of 22 bytes of attributes, grey takes 1, the time 1/4, the others little.
  EXPECT_LT(bytes[0], 8000 * 5);
  EXPECT_LT(bytes[0], bytes[1] / 2);
}

TEST(Store, DecimalAttributesTakeFewBytes) {
  StoreSchema schema = testing::cloud_schema();
  schema.attributes.push_back(testing::channel("t", ScalarType::f64));
  auto blocks = testing::cloud_blocks(testing::CoordinateKind::decimals, 6000, 900, 7);
  std::uint64_t row = 0;
  for (auto& block : blocks) {
    for (std::size_t i = 0; i < block.positions.size(); ++i, ++row) {
      const double value = static_cast<double>(row % 50) / 100;
      const auto* bytes = reinterpret_cast<const std::byte*>(&value);
      block.payload.insert(block.payload.end(), bytes, bytes + 8);
    }
  }
  const std::uint64_t with =
      testing::check_round_trip(schema, blocks, {.block_points = 900, .cluster_points = 60});
  for (auto& block : blocks) block.payload.clear();
  const std::uint64_t without = testing::check_round_trip(
      testing::cloud_schema(), blocks, {.block_points = 900, .cluster_points = 60});
  EXPECT_LT(with, without + 6000 * 2);
}

// Ranges contain the values and are close to them, also for NaN and the limits of 64 bits.
TEST(Store, RangesOfAttributesContainTheirValues) {
  StoreSchema schema = testing::cloud_schema();
  for (const ScalarType type : testing::kAllTypes) {
    schema.attributes.push_back(testing::channel(std::string(name_of(type)), type));
  }
  schema.attributes[2].scale = -0.5;
  schema.attributes[2].offset = 3;
  auto blocks = testing::cloud_blocks(testing::CoordinateKind::decimals, 6000, 900, 5);
  std::mt19937_64 random(8);
  std::uint64_t row = 0;
  for (auto& block : blocks) {
    for (std::size_t i = 0; i < block.positions.size(); ++i, ++row) {
      for (const Channel& channel : schema.attributes) {
        const std::uint64_t value = row < 3000 ? random() >> row / 50 : row / 60;
        const auto* bytes = reinterpret_cast<const std::byte*>(&value);
        block.payload.insert(block.payload.end(), bytes, bytes + size_of(channel.type));
      }
    }
  }
  const TempFolder folder;
  const auto path = folder.path() / "store";
  testing::write_store(path, schema, blocks, {.block_points = 900, .cluster_points = 60});
  const Store store = Store::open(path);
  for (unsigned level = 0; level <= store.top(); ++level) {
    store.for_each(level, [&](ClusterId id, const ClusterRecord&, const ClusterPoints& points) {
      const std::vector<ValueRange> ranges = store.attribute_ranges(id);
      ASSERT_EQ(ranges.size(), schema.attributes.size());
      std::size_t at = 0;
      for (std::size_t a = 0; a < ranges.size(); ++a) {
        const Channel& channel = schema.attributes[a];
        double low = INFINITY, high = -INFINITY;
        for (std::size_t i = 0; i < points.size(); ++i) {
          const double value =
              to_double(channel.type, points.payload.data() + i * schema.payload_size() + at) *
                  channel.scale +
              channel.offset;
          if (std::isnan(value)) {
            EXPECT_TRUE(ranges[a].nan);
          } else {
            EXPECT_LE(ranges[a].low, value);
            EXPECT_GE(ranges[a].high, value);
          }
          low = std::min(low, value);
          high = std::max(high, value);
        }
        at += size_of(channel.type);
        // Wider by at most a 32nd of the page's range at either end.
        if (channel.type == ScalarType::u32) {
          EXPECT_LE(ranges[a].high - ranges[a].low, high - low + 0x1p32 / 31 * 2);
        }
      }
    });
  }
  EXPECT_THROW(static_cast<void>(store.attribute_ranges(cluster_id(0, 1u << 20))), Error);
}

/// Reads the files of a store into memory, by name.
std::map<std::string, std::vector<std::byte>> files_in_memory(const std::filesystem::path& store) {
  std::map<std::string, std::vector<std::byte>> files;
  for (const auto& entry : std::filesystem::directory_iterator(store)) {
    const std::string bytes = testing::bytes_of(entry.path());
    const auto view = std::as_bytes(std::span(bytes));
    files[entry.path().filename()] = {view.begin(), view.end()};
  }
  return files;
}

TEST(Store, OpensFromMemory) {
  const std::filesystem::path folder =
      std::filesystem::path(TERRACE_TEST_DATA) / "stores" / "cloud";
  const auto files = files_in_memory(folder);
  const Store store = Store::open("memory", [&files](const std::string& name) {
    return bytes_in_memory("memory/" + name, files.at(name));
  });
  EXPECT_EQ(store.path(), "memory");
  EXPECT_TRUE(store.verify(testing::fail_on_problem));
  EXPECT_EQ(testing::all_points(store), testing::all_points(Store::open(folder)));
}

TEST(Store, PassesOnExceptionsOfTheCallersFiles) {
  const auto files = files_in_memory(std::filesystem::path(TERRACE_TEST_DATA) / "stores" / "grid");
  struct Lost : std::runtime_error {
    using std::runtime_error::runtime_error;
  };
  // Each read in turn fails, and opening and verifying throw what the function threw.
  for (int failing = 0;; ++failing) {
    int reads = 0;
    const auto open = [&] {
      return Store::open("server", [&](const std::string& name) {
        const auto& bytes = files.at(name);
        return bytes_by_function("server/" + name, bytes.size(),
                                 [&](std::uint64_t offset, std::span<std::byte> out) {
                                   if (reads++ == failing) throw Lost("connection");
                                   std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(offset),
                                               out.size(), out.begin());
                                 });
      });
    };
    try {
      testing::all_points(open());
      EXPECT_GT(failing, 5);
      break;
    } catch (const Lost&) {
    }
  }
  // A file shorter than the manifest says is refused at once.
  const auto cut = [&](const std::string& name) {
    auto bytes = files.at(name);
    if (name != "manifest.json") bytes.pop_back();
    return bytes_in_memory("server/" + name, std::move(bytes));
  };
  EXPECT_THROW(Store::open("server", cut), Error);
}

/// Blocks of still water are equal, so their clusters share the bytes of the first one.
TEST(Store, EqualBlocksShareTheirBytes) {
  const auto water = [](int side, bool still) {
    std::mt19937_64 random(1);
    std::vector<testing::PushedBlock> blocks;
    for (int tile = 0; tile < side * side; ++tile) {
      testing::PushedBlock& block = blocks.emplace_back();
      for (int cell = 0; cell < 400; ++cell) {
        const int x = 20 * (tile % side) + cell % 20, y = 20 * (tile / side) + cell / 20;
        block.positions.push_back({static_cast<double>(x), static_cast<double>(y),
                                   still ? 7.0 : static_cast<double>(random() % 5)});
      }
    }
    return blocks;
  };
  const testing::StandInHierarchy::Options options{.block_points = 400, .cluster_points = 40};
  const StoreSchema schema = testing::grid_schema(ScalarType::i16);
  testing::check_round_trip(schema, water(20, true), options);
  const auto data_bytes = [&](bool still) {
    const TempFolder folder;
    testing::write_store(folder.path() / "s", schema, water(20, still), options);
    return std::filesystem::file_size(folder.path() / "s" / "level-0.0.clusters");
  };
  EXPECT_LT(data_bytes(true), 1000u);
  EXPECT_GT(data_bytes(false), 20000u);
}

/// Every version must read these stores; see data/stores/README.md.
TEST(Store, GoldenStoresAreSound) {
  const std::filesystem::path folder = std::filesystem::path(TERRACE_TEST_DATA) / "stores";
  for (const auto& [name, points] : {std::pair<const char*, std::uint64_t>{"grid", 8530},
                                     {"int64", 432},
                                     {"uint64", 432},
                                     {"cloud", 1200},
                                     {"empty", 0},
                                     {"survey", 1500},
                                     {"island", 11314},
                                     {"swath", 2236}}) {
    SCOPED_TRACE(name);
    const Store store = Store::open(folder / name);
    EXPECT_EQ(store.version(), 1);
    EXPECT_EQ(store.points(), points);
    EXPECT_TRUE(store.verify(testing::fail_on_problem));
  }
  const Store store = Store::open(folder / "grid");
  EXPECT_EQ(Overlay::open(folder / "grid.overlay", store).values(), 918u);
}

/// The bytes of a store do not depend on the compiler or its optimisation: GCC at -O3 and with
/// sanitizers, and Clang at -O1, give these checksums. They change only with the format.
TEST(Store, ChecksumsAreTheSameWithEveryCompiler) {
  const TempFolder folder;
  const auto checksum = [&](const char* name, const StoreSchema& schema, const auto& blocks) {
    testing::write_store(folder.path() / name, schema, blocks,
                         {.block_points = 900, .cluster_points = 60});
    return Store::open(folder.path() / name).checksum();
  };
  EXPECT_EQ(
      checksum("grid", testing::grid_schema(ScalarType::f32),
               testing::grid_blocks(ScalarType::f32, testing::ReliefKind::fractal, 96, 88, 30, 1)),
      0x91caf359u);
  EXPECT_EQ(checksum("cloud", testing::cloud_schema(),
                     testing::cloud_blocks(testing::CoordinateKind::mixed, 8000, 900, 4)),
            0x33b7b423u);
}

}  // namespace
}  // namespace terrace::stream
