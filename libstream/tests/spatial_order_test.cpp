// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/spatial_order.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "order/kd_cut.hpp"
#include "order/record_packer.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kBlock = 1000;

/// A source of points on a surface, each with its number as an attribute.
class GeneratedPoints final : public PointSource {
 public:
  using Place = std::function<Point3(std::uint64_t)>;

  GeneratedPoints(std::uint64_t count, Place place, ScalarType type = ScalarType::f64)
      : count_(count), place_(std::move(place)) {
    info_.format = "synthetic";
    for (Channel& channel : info_.coordinates) channel.type = type;
    info_.attributes = {{.name = "mark", .type = ScalarType::u8},
                        {.name = "number", .type = ScalarType::u64}};
  }
  void state(std::uint64_t points, std::optional<Box3> bounds) {
    info_.points = points;
    info_.stated_bounds = bounds;
  }
  /// Sets the number of points per block; blocks have room for kBlock.
  void block_points(std::size_t points) { block_points_ = points; }
  const SourceInfo& info() const override { return info_; }
  Progress progress() const override { return {.points = next_}; }
  bool next(PointBlock& block) override {
    block.clear();
    block.positions.reserve(kBlock);
    for (std::size_t i = 0; i < block_points_ && next_ < count_; ++i, ++next_) {
      block.positions.push_back(place_(next_));
      std::array<std::byte, 9> record{std::byte{7}};
      std::memcpy(record.data() + 1, &next_, sizeof next_);
      block.payload.insert(block.payload.end(), record.begin(), record.end());
    }
    return !block.empty();
  }

 private:
  SourceInfo info_;
  std::uint64_t count_, next_ = 0;
  std::size_t block_points_ = 777;
  Place place_;
};

Point3 on_surface(double x, double y) { return {x, y, std::floor(20 * std::sin(x / 90))}; }

/// Returns places in rows of `width`.
GeneratedPoints::Place rows(std::uint64_t width) {
  return [width](std::uint64_t i) {
    return on_surface(static_cast<double>(i % width), static_cast<double>(i / width));
  };
}

/// Returns the places of a square of `side` x `side`, visited repeatedly in random order.
GeneratedPoints::Place shuffled(std::uint64_t side) {
  return [side](std::uint64_t i) {
    // Steps by an odd number visit every place if their number is a power of two.
    const std::uint64_t place = (i * 0x9E3779B97F4A7C15u) % (side * side);
    return on_surface(static_cast<double>(place % side), static_cast<double>(place / side));
  };
}

/// Returns the places of squares of `side` x `side` one after another, along rows of squares.
GeneratedPoints::Place squares(std::uint64_t side) {
  return [side](std::uint64_t i) {
    const std::uint64_t square = i / (side * side), in = i % (side * side);
    return on_surface(static_cast<double>(square % 40 * side + in % side),
                      static_cast<double>(square / 40 * side + in / side));
  };
}

struct Read {
  std::vector<PointBlock> blocks;
  OrderedSource::Report report;

  /// Returns the mean width of the blocks in the plane.
  [[nodiscard]] double width() const {
    double widths = 0;
    for (const PointBlock& block : blocks) {
      Box3 box;
      for (const Point3& p : block.positions) box.include(p);
      widths += box.max[0] - box.min[0] + box.max[1] - box.min[1];
    }
    return widths / static_cast<double>(blocks.size());
  }
};

Read read(std::uint64_t count, const GeneratedPoints::Place& place, Order order,
          ScalarType type = ScalarType::f64) {
  const auto source = in_spatial_order(std::make_unique<GeneratedPoints>(count, place, type),
                                       {.order = order, .block_points = kBlock});
  Read read;
  PointBlock block;
  while (source->next(block)) {
    read.blocks.push_back(block);
    EXPECT_LE(block.size(), kBlock);
  }
  EXPECT_FALSE(source->next(block));
  EXPECT_EQ(source->progress().points, count);
  read.report = source->report();
  return read;
}

/// Expects that every point was delivered once, at its place, with its record.
void expect_all(const Read& read, std::uint64_t count, const GeneratedPoints::Place& place) {
  std::vector<bool> met(count);
  std::uint64_t points = 0;
  for (const PointBlock& block : read.blocks) {
    ASSERT_EQ(block.payload.size(), 9 * block.size());
    for (std::size_t i = 0; i < block.size(); ++i) {
      std::uint64_t number = 0;
      std::memcpy(&number, block.payload.data() + 9 * i + 1, sizeof number);
      ASSERT_LT(number, count);
      ASSERT_EQ(block.payload[9 * i], std::byte{7});
      ASSERT_FALSE(met[number]);
      ASSERT_EQ(block.positions[i], place(number));
      met[number] = true;
      ++points;
    }
  }
  EXPECT_EQ(points, count);
}

bool same(const Read& a, const Read& b) {
  return a.blocks.size() == b.blocks.size() &&
         std::equal(a.blocks.begin(), a.blocks.end(), b.blocks.begin(),
                    [](const PointBlock& one, const PointBlock& other) {
                      return one.positions == other.positions && one.payload == other.payload;
                    });
}

TEST(SpatialOrderTest, DeliversShuffledPointsInCompactBlocks) {
  constexpr std::uint64_t kSide = 1024, kCount = kSide * kSide;
  for (const ScalarType type : {ScalarType::f64, ScalarType::i32, ScalarType::i16}) {
    const Read ordered = read(kCount, shuffled(kSide), Order::automatic, type);
    expect_all(ordered, kCount, shuffled(kSide));
    EXPECT_TRUE(ordered.report.reordered);
    EXPECT_GT(ordered.report.spread, 10);
    // As compact as pieces of a k-d tree with this many places.
    EXPECT_LT(ordered.width(), 1.3 * 2 * std::sqrt(kBlock));
    const std::uint64_t record = 3 * size_of(type) + 9;
    // `mark` and most bytes of the number are not written.
    EXPECT_LE(ordered.report.temporary_bytes, kCount * (record - 5));
    EXPECT_GT(ordered.report.temporary_bytes, kCount * record / 8);
    if (type != ScalarType::i16) continue;
    EXPECT_TRUE(same(ordered, read(kCount, shuffled(kSide), Order::spatial, type)));
  }
}

TEST(SpatialOrderTest, UsesNoDiskIfPointsFitInAWindow) {
  for (const std::uint64_t count : {0u, 1u, 999u, 1000u, 1001u, 100000u}) {
    const Read ordered = read(count, shuffled(1024), Order::spatial);
    expect_all(ordered, count, shuffled(1024));
    EXPECT_EQ(ordered.report.temporary_bytes, 0u);
    EXPECT_EQ(ordered.blocks.size(), (count + kBlock - 1) / kBlock);
  }
}

TEST(SpatialOrderTest, KeepsCompactStreams) {
  constexpr std::uint64_t kCount = 1u << 20;
  for (const Order order : {Order::automatic, Order::stream}) {
    const Read passed = read(kCount, squares(32), order);
    expect_all(passed, kCount, squares(32));
    EXPECT_FALSE(passed.report.reordered);
    EXPECT_EQ(passed.report.temporary_bytes, 0u);
    EXPECT_LT(passed.report.spread, 2);
    EXPECT_EQ(passed.blocks.front().size(), 777u);
  }
}

TEST(SpatialOrderTest, DoesNotJudgeAStreamThatKeepsItsOrder) {
  const Read passed = read(50000, shuffled(1024), Order::stream);
  expect_all(passed, 50000, shuffled(1024));
  EXPECT_FALSE(passed.report.reordered);
  EXPECT_EQ(passed.report.spread, 0);
}

TEST(SpatialOrderTest, ReordersWideScanLines) {
  constexpr std::uint64_t kCount = 1u << 20;
  const Read ordered = read(kCount, rows(4096), Order::automatic);
  expect_all(ordered, kCount, rows(4096));
  EXPECT_TRUE(ordered.report.reordered);
  EXPECT_LT(ordered.width(), 1.3 * 2 * std::sqrt(kBlock));
}

// The first planes are based only on the beginning of the stream, so nearly all points after it go
// to one bucket.
TEST(SpatialOrderTest, DividesLargeBuckets) {
  constexpr std::uint64_t kCount = 2u << 20;
  const auto place = [](std::uint64_t i) {
    Point3 p = rows(1 << 14)(i);
    p[1] = p[1] * p[1];
    return p;
  };
  const Read ordered = read(kCount, place, Order::spatial);
  expect_all(ordered, kCount, place);
  const std::uint64_t records = kCount * (3 * 8 + 9);
  EXPECT_LE(ordered.report.temporary_bytes, records + records / 5);
}

TEST(SpatialOrderTest, ReordersAStreamFromWhereItLosesItsOrder) {
  constexpr std::uint64_t kOrdered = 1u << 20, kCount = 2u << 20;
  const auto place = [](std::uint64_t i) {
    return i < kOrdered ? squares(32)(i) : shuffled(1024)(i);
  };
  const Read ordered = read(kCount, place, Order::automatic);
  expect_all(ordered, kCount, place);
  EXPECT_TRUE(ordered.report.reordered);
  EXPECT_EQ(ordered.blocks.front().size(), 777u);
  EXPECT_LT(ordered.report.temporary_bytes, kOrdered * (3 * 8 + 9));
}

TEST(SpatialOrderTest, DeliversManyPointsAtOnePlace) {
  constexpr std::uint64_t kCount = 300000;  // more than one window
  const auto duplicates = [](std::uint64_t) { return Point3{1, 2, 3}; };
  expect_all(read(kCount, duplicates, Order::spatial), kCount, duplicates);
  const auto mostly = [](std::uint64_t i) {
    return i % 1000 == 0 ? on_surface(static_cast<double>(i), 5) : Point3{1, 2, 3};
  };
  expect_all(read(kCount, mostly, Order::spatial), kCount, mostly);
  const auto line = [](std::uint64_t i) { return Point3{static_cast<double>(i % 3), 0, 0}; };
  expect_all(read(kCount, line, Order::spatial), kCount, line);
}

TEST(SpatialOrderTest, MeasuresDegreesAndMetresOnTheGround) {
  constexpr std::uint64_t kCount = 1u << 19;
  const auto place = [](std::uint64_t i) {
    Point3 p = shuffled(1024)(i);
    return Point3{p[0] * 1e-5, p[1] * 1e-5, static_cast<double>(i * 7919 % 100)};
  };
  const auto source = in_spatial_order(std::make_unique<GeneratedPoints>(kCount, place),
                                       {.block_points = kBlock, .unit_lengths = [](const Box3&) {
                                          return std::array<double, 3>{1e5, 1e5, 1};
                                        }});
  Read ordered;
  for (PointBlock block; source->next(block);) ordered.blocks.push_back(block);
  expect_all(ordered, kCount, place);
  EXPECT_LT(ordered.width(), 0.01 * 20);
}

/// Thousands of files of one point each take the memory of their points, not that of a block each.
TEST(SpatialOrderTest, HoldsSmallBlocksTogether) {
  constexpr std::uint64_t kCount = 300'000;
  for (const auto& [place, order] :
       {std::pair{squares(100), Order::automatic}, std::pair{shuffled(1024), Order::automatic},
        std::pair{squares(100), Order::spatial}}) {
    for (const std::size_t block_points : {std::size_t{1}, std::size_t{600}}) {
      auto points_source = std::make_unique<GeneratedPoints>(kCount, place);
      points_source->block_points(block_points);
      const auto source =
          in_spatial_order(std::move(points_source), {.order = order, .block_points = kBlock});
      Read result;
      std::uint64_t points = 0, room = 0;
      for (PointBlock block; source->next(block); block = {}) {
        points += block.size();
        // Only the first window counts, because it is held until its order is judged.
        if (points <= 1u << 18) room += block.positions.capacity();
        EXPECT_LE(block.size(), kBlock);
        result.blocks.push_back(block);
      }
      expect_all(result, kCount, place);
      EXPECT_LT(room, 1.3 * (1u << 18));
      EXPECT_LT(result.blocks.size(), block_points == 1 ? 40'000u : 600u);
    }
  }
}

TEST(SpatialOrderTest, ThreadsDoNotChangeTheOrder) {
  constexpr std::uint64_t kCount = 1'300'000;
  for (const auto& place : {shuffled(1024), rows(1 << 16), squares(100)}) {
    const Read expected = read(kCount, place, Order::spatial);
    for (const auto& [threads, ahead] : {std::pair{2u, 0u}, {2u, 3u}, {5u, 1u}}) {
      const auto source = in_spatial_order(std::make_unique<GeneratedPoints>(kCount, place),
                                           {.order = Order::spatial,
                                            .block_points = kBlock,
                                            .threads = threads,
                                            .parts_ahead = ahead});
      Read result;
      for (PointBlock block; source->next(block);) result.blocks.push_back(block);
      EXPECT_TRUE(same(result, expected)) << threads << " threads, " << ahead << " ahead";
      // Chunks of buckets are written in another order, so another chunk may be the last, shorter
      // one.
      EXPECT_NEAR(static_cast<double>(source->report().temporary_bytes),
                  static_cast<double>(expected.report.temporary_bytes), 32 << 10);
    }
  }
}

TEST(SpatialOrderTest, AStatedBoxAvoidsDividingTheOutermostBuckets) {
  // The first window is one corner of the square. Without a box nearly all points are outside it.
  constexpr std::uint64_t kCount = 3'000'000;
  const auto place = squares(512);
  Box3 box;
  for (std::uint64_t i = 0; i < kCount; i += 511) box.include(place(i));
  const auto ordered = [&](std::optional<Box3> stated) {
    auto points_source = std::make_unique<GeneratedPoints>(kCount, place);
    points_source->state(kCount, stated);
    const auto source = in_spatial_order(std::move(points_source),
                                         {.order = Order::spatial, .block_points = kBlock});
    Read read;
    for (PointBlock block; source->next(block);) read.blocks.push_back(block);
    expect_all(read, kCount, place);
    read.report = source->report();
    return read;
  };
  const Read blind = ordered(std::nullopt), with_box = ordered(box);
  EXPECT_LT(with_box.width(), 1.05 * blind.width());
  EXPECT_GT(blind.report.written_twice, kCount / 2);
  EXPECT_LT(with_box.report.written_twice, kCount / 10);
  // A wrong or invalid box does no harm.
  Box3 far;
  far.include(Point3{1e9, 1e9, 1e9});
  far.include(Point3{2e9, 2e9, 2e9});
  EXPECT_LT(ordered(far).width(), 1.05 * blind.width());
  Box3 endless;
  endless.include(Point3{-HUGE_VAL, 0, 0});
  endless.include(Point3{HUGE_VAL, 1, 1});
  EXPECT_TRUE(same(ordered(endless), blind));
  EXPECT_TRUE(same(ordered(Box3{}), blind));
}

TEST(SpatialOrderTest, EndsWithAStopRequest) {
  std::stop_source stop;
  const auto source = in_spatial_order(
      std::make_unique<GeneratedPoints>(1u << 20, shuffled(1024)),
      {.block_points = kBlock, .stop = stop.get_token(), .reading = [&](const Progress& progress) {
         if (progress.points > 400000) stop.request_stop();
       }});
  PointBlock block;
  EXPECT_THROW(source->next(block), Stopped);
}

TEST(SpatialOrderTest, NamesAFolderThatDoesNotExist) {
  const TempFolder folder;
  const auto source = in_spatial_order(std::make_unique<GeneratedPoints>(1u << 20, shuffled(1024)),
                                       {.block_points = kBlock, .folder = folder.path() / "none"});
  PointBlock block;
  try {
    source->next(block);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("none"), std::string::npos) << error.what();
  }
}

TEST(KdCutTest, CutsIntegersLikeDoubles) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const std::array<double, 3> lengths{1, 1, 0.5};
  for (int round = 0; round < 300; ++round) {
    // From a single place, over many equal ones, to the limits of the type.
    const auto bits = static_cast<unsigned>(random() % 33);
    std::vector<NumberedIntegers> integers(1 + random() % 3000);
    std::vector<NumberedPoint> doubles;
    for (std::uint32_t i = 0; i < integers.size(); ++i) {
      for (std::int32_t& value : integers[i].place) {
        value = static_cast<std::int32_t>(bits == 0
                                              ? 7
                                              : static_cast<std::int64_t>(random() >> (32 - bits)) -
                                                    (std::int64_t{1} << (bits - 1)));
      }
      integers[i].number = i;
      const auto& [x, y, z] = integers[i].place;
      doubles.push_back(
          {Point3{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)}, i});
    }
    const std::size_t pieces = 1 + random() % std::min<std::size_t>(integers.size(), 40);
    const auto begins = cut_in_pieces(std::span(integers), pieces, lengths);
    ASSERT_EQ(begins, cut_in_pieces(std::span(doubles), pieces, lengths));
    const auto pieces_of = [&](const auto& points) {
      std::vector<std::size_t> piece_of(points.size());
      for (std::size_t piece = 0; piece < pieces; ++piece) {
        for (std::size_t i = begins[piece]; i < begins[piece + 1]; ++i) {
          piece_of[points[i].number] = piece;
        }
      }
      return piece_of;
    };
    ASSERT_EQ(pieces_of(integers), pieces_of(doubles));
  }
}

TEST(RecordPackerTest, RoundTripsRecords) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < 2000; ++round) {
    const std::size_t bytes = 1 + random() % 70, count = 1 + random() % 40;
    std::vector<std::byte> first(bytes);
    for (std::byte& b : first) b = static_cast<std::byte>(random());
    const unsigned often = random() % 4;
    std::vector<bool> varies(bytes);
    for (std::size_t b = 0; b < bytes; ++b) varies[b] = random() % 3 < often;
    std::vector<std::byte> records;
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t b = 0; b < bytes; ++b) {
        records.push_back(varies[b] ? static_cast<std::byte>(random()) : first[b]);
      }
    }
    RecordPacker packer(bytes);
    const std::span<const std::byte> view = packer.pack(records);
    // Buffers of the exact sizes, so that a sanitizer detects access beyond them.
    const std::vector<std::byte> packed(view.begin(), view.end());
    ASSERT_LE(packed.size(), (2 + count) * bytes);
    if (often == 0) {
      ASSERT_EQ(packed.size(), bytes < 3 ? (2 + count) * bytes : 2 * bytes);
    }
    std::vector<std::byte> unpacked(records.size());
    RecordPacker(bytes).unpack(packed, unpacked);
    ASSERT_EQ(unpacked, records);
  }
}

}  // namespace
}  // namespace terrace::stream
