// SPDX-License-Identifier: Apache-2.0
// Checks the statements of FORMAT.md about clusters and tables one by one: a store that violates
// one of them, with good checksums, is refused when it is opened or read, or reported by verify.
#include <array>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "store/codec/column.hpp"
#include "store/codec/form.hpp"
#include "store/read/cluster_decoder.hpp"
#include "store_testing.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/store.hpp"

namespace terrace::stream {
namespace {

using store::Entry;

/// Returns tables in which every symbol can be coded, so that any cluster can be written.
store::Tables even_tables(const store::Layout& layout, store::ColumnKind kind) {
  store::Tables tables;
  tables.kinds.assign(layout.columns(), kind);
  std::array<std::uint32_t, store::kSymbols> counts{};
  for (unsigned s = 0; s < 40; ++s) counts[s] = 40;
  tables.frequencies.assign(layout.contexts(), store::normalised(counts));
  return tables;
}

/// Decodes a cluster of `points` points in the box (0, 0, 0) to (width - 1, 7, 7). Returns the
/// error, or "read".
std::string decoding_error(bool grid, std::uint32_t points, std::uint32_t last,
                           const std::function<void(store::SymbolEncoder&)>& write,
                           const std::function<void(store::Bytes&)>& change = {},
                           store::ColumnKind kind = store::ColumnKind::plain,
                           std::uint64_t width = 8) {
  StoreSchema schema;
  schema.grid = grid;
  const store::Layout layout(schema, 0);
  const store::Tables tables = even_tables(layout, kind);
  const store::EncodingTables encoding(tables);
  const store::DecodingTables decoding(tables);
  store::SymbolEncoder encoder(encoding.tables);
  encoder.start();
  write(encoder);
  store::Bytes bytes(store::kPadding);
  encoder.finish(last, bytes);
  if (change) change(bytes);
  Entry entry;
  entry.points = points;
  entry.size = {width, 8, 8};
  entry.bytes = static_cast<std::uint32_t>(bytes.size() - store::kPadding);
  bytes.resize(bytes.size() + store::kPadding);
  store::ClusterDecoder decoder;
  ClusterPoints out;
  try {
    decoder.decode(layout, decoding, entry,
                   store::ByteView(bytes).subspan(store::kPadding, entry.bytes), false, out);
  } catch (const store::Damage& damage) {
    return damage.what();
  }
  EXPECT_EQ(out.size() + 1, points);
  return "read";
}

TEST(StoreInvariants, RefusesClustersThatBreakTheRules) {
  using store::SymbolEncoder;
  namespace context = store::context;
  const auto number = [](SymbolEncoder& coder, unsigned where, std::uint64_t value) {
    store::code_number(coder, where, value);
  };
  const auto one_point = [&](SymbolEncoder& coder) {
    coder.symbol(context::kForm, store::kSplitForm);
    for (std::uint64_t axis = 0; axis < 3; ++axis) store::code_uniform(coder, axis, 8);
  };
  const auto own_box = [&](SymbolEncoder& coder, std::uint64_t below, std::uint64_t above) {
    coder.symbol(context::kForm, store::kSplitForm | store::kOwnBoxForm);
    for (unsigned side = 0; side < 6; ++side) {
      number(coder, context::kInset + side, side == 0 ? below : side == 1 ? above : 7 * (side % 2));
    }
  };
  const auto run = [&](SymbolEncoder& coder, std::uint64_t begin, std::uint64_t length) {
    coder.symbol(context::kForm, 0);
    number(coder, context::kRunCount, 1);
    number(coder, context::kRunStart, begin);
    number(coder, context::kRunEnd, length - 1);
    for (unsigned row = 1; row < 8; ++row) number(coder, context::kRunCount + (row == 1), 0);
  };
  // A correct cluster is read.
  EXPECT_EQ(decoding_error(false, 1, 0, one_point), "read");
  EXPECT_EQ(decoding_error(false, 1, 0, [&](auto& coder) { own_box(coder, 3, 4); }), "read");
  const auto flat_run = [&](SymbolEncoder& coder) {
    run(coder, 2, 1);
    number(coder, context::kHeight + 63, 4);
  };
  EXPECT_EQ(decoding_error(true, 1, 0, flat_run), "read");

  EXPECT_EQ(decoding_error(false, 1, 1, one_point),
            "a cluster's representative is not one of its points");
  EXPECT_EQ(decoding_error(false, 1, 0, [](auto& coder) { coder.symbol(context::kForm, 4); }),
            "a cluster has an unknown form");
  EXPECT_EQ(decoding_error(false, 1, 0, [&](auto& coder) { own_box(coder, 4, 4); }),
            "a cluster's own box is not inside its index entry's");
  EXPECT_EQ(decoding_error(true, 1, 0, flat_run, {}, store::ColumnKind::plain, 100000),
            "a cluster's box does not fit its form");
  EXPECT_EQ(decoding_error(true, 1, 0, [&](auto& coder) { run(coder, 8, 1); }),
            "a run is outside its cluster");
  EXPECT_EQ(decoding_error(true, 1, 0, [&](auto& coder) { run(coder, 2, 2); }),
            "a run is outside its cluster");
  EXPECT_EQ(decoding_error(true, 2, 0, [&](auto& coder) { run(coder, 2, 1); }),
            "a cluster has too few cells");
  EXPECT_EQ(decoding_error(true, 1, 0,
                           [&](auto& coder) {
                             run(coder, 2, 1);
                             number(coder, context::kHeight + 63, 10);
                           }),
            "a height is outside its cluster's box");
  EXPECT_EQ(decoding_error(false, 2, 0,
                           [](auto& coder) {
                             coder.symbol(context::kForm, store::kSplitForm);
                             coder.symbol(context::kSplit, 3);
                           }),
            "a part of a cluster has more points than the whole");
  // Nine raw bits are followed by seven bits of padding.
  const char* const ends = "coded bytes do not end after their last number";
  EXPECT_EQ(decoding_error(false, 1, 0, one_point,
                           [](store::Bytes& bytes) { bytes[bytes.size() - 2] ^= 1; }),
            ends);
  EXPECT_EQ(decoding_error(false, 1, 0, one_point,
                           [](store::Bytes& bytes) { bytes.insert(bytes.end() - 2, 1, 0); }),
            ends);
  // 2^20 points at one place take a few bytes; more are refused.
  const auto same_place = [&](SymbolEncoder& coder) {
    coder.symbol(context::kForm, store::kSplitForm | store::kOwnBoxForm);
    for (unsigned side = 0; side < 6; ++side) number(coder, context::kInset + side, 7 * (side % 2));
    coder.raw(0, 16);
  };
  EXPECT_EQ(decoding_error(false, 1u << 20, 0, same_place), "read");
  EXPECT_EQ(decoding_error(false, (1u << 20) + 1, 0, same_place), "a cluster has too many points");
}

TEST(StoreInvariants, RefusesColumnsThatBreakTheRules) {
  using store::ColumnKind;
  using store::SymbolEncoder;
  constexpr unsigned kAxis = store::context::kAttribute, kNext = store::context::kPerAttribute;
  const auto number = [](SymbolEncoder& coder, unsigned where, std::uint64_t value) {
    store::code_number(coder, where, value);
  };
  // Writes the places of two points: `first` writes the column of x; y and z are 5 for both.
  const auto places = [number](const std::function<void(SymbolEncoder&)>& first) {
    return [first, number](SymbolEncoder& coder) {
      coder.symbol(store::context::kForm, 0);
      first(coder);
      for (unsigned axis = 1; axis < 3; ++axis) {
        coder.symbol(kAxis + kNext * axis, 0);
        number(coder, kAxis + kNext * axis + 1, 10);
      }
    };
  };
  const auto column = [number](unsigned head, const std::vector<std::uint64_t>& numbers) {
    return [head, numbers, number](SymbolEncoder& coder) {
      coder.symbol(kAxis, head);
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        // The first value and the divisor, then a difference in the context of the first value's
        // class.
        const bool last = head != 0 && i + 1 == numbers.size();
        const unsigned step = store::difference_step(store::class_of(numbers[0]));
        number(coder, last ? kAxis + 2 + step : kAxis + 1, numbers[i]);
      }
    };
  };
  EXPECT_EQ(decoding_error(false, 2, 0, places(column(0, {14}))), "read");
  EXPECT_EQ(decoding_error(false, 2, 0, places(column(1, {4, 10}))), "read");
  EXPECT_EQ(decoding_error(false, 2, 0, places(column(2, {4, 5, 2}))), "read");

  const char* const outside = "a point is outside its cluster's box";
  EXPECT_EQ(decoding_error(false, 2, 0, places(column(0, {16}))), outside);
  EXPECT_EQ(decoding_error(false, 2, 0, places(column(0, {1}))), outside);
  EXPECT_EQ(decoding_error(false, 2, 0, places(column(1, {4, 12}))), outside);
  EXPECT_EQ(decoding_error(false, 2, 0, places(column(2, {4, 6, 2}))), outside);
  EXPECT_EQ(decoding_error(false, 2, 0, places(column(3, {4, 10}))),
            "a column has an unknown head");
  EXPECT_EQ(decoding_error(false, 2, 0, places(column(2, {4, 1, 2}))),
            "a column has a divisor below 2");
  const auto recent = [number](unsigned place) {
    return [place, number](SymbolEncoder& coder) {
      coder.symbol(kAxis, 1);
      number(coder, kAxis + 1, 4);
      coder.symbol(kAxis + 2, place);
    };
  };
  EXPECT_EQ(decoding_error(false, 2, 0, places(recent(1)), {}, ColumnKind::recent), "read");
  EXPECT_EQ(decoding_error(false, 2, 0, places(recent(4)), {}, ColumnKind::recent),
            "a column has an unknown difference");
}

TEST(StoreInvariants, RefusesUnknownKindsOfColumns) {
  StoreSchema schema;
  schema.attributes = {{.name = "a", .type = ScalarType::u8},
                       {.name = "b", .type = ScalarType::f32},
                       {.name = "c", .type = ScalarType::u16},
                       {.name = "d", .type = ScalarType::i64}};
  const store::Layout layout(schema, 0);
  for (std::size_t column = 0; column < layout.columns(); ++column) {
    store::Tables tables = even_tables(layout, store::ColumnKind::plain);
    tables.kinds[column] = store::ColumnKind::preceding;
    store::Bytes bytes;
    tables.write(bytes);
    if (column == 3) {
      EXPECT_EQ(store::Tables::read(bytes, layout).kinds, tables.kinds);
    } else {
      EXPECT_THROW(store::Tables::read(bytes, layout), store::Damage) << column;
    }
    const std::size_t kind = 9 + column, guide = 8;
    bytes[kind] = 3;
    EXPECT_THROW(store::Tables::read(bytes, layout), store::Damage) << column;
    // With a guide there are more kinds, except for the guide itself.
    bytes[guide] = 4;
    if (column == 3) {
      EXPECT_THROW(store::Tables::read(bytes, layout), store::Damage);
      bytes[kind] = 2;
      EXPECT_THROW(store::Tables::read(bytes, layout), store::Damage);
      bytes[kind] = 1;
    }
    EXPECT_EQ(store::Tables::read(bytes, layout).guide.attribute, 3u);
    bytes[kind] = 10;
    EXPECT_THROW(store::Tables::read(bytes, layout), store::Damage) << column;
    bytes[kind] = 0;
    bytes[guide] = 5;
    EXPECT_THROW(store::Tables::read(bytes, layout), store::Damage) << column;
  }
}

/// Clusters that would take much memory are neither written nor read, however few bytes they have.
TEST(StoreInvariants, RefusesClustersThatTakeMuchMemory) {
  StoreSchema schema = testing::cloud_schema();
  for (int i = 0; i < 4096; ++i) {
    schema.attributes.push_back(testing::channel(std::to_string(i)));
  }
  const std::uint64_t max_points = store::Layout(schema, 0).max_points();
  EXPECT_LE(max_points * schema.payload_size(), std::uint64_t{1} << 28);
  const TempFolder folder;
  StoreWriter writer(folder.path() / "s", schema);
  const std::vector<Point3> positions(max_points + 1);
  std::vector<std::uint32_t> order(max_points + 1);
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  const std::vector<std::byte> payload(positions.size() * schema.payload_size());
  const std::vector<std::uint32_t> first{0, static_cast<std::uint32_t>(max_points + 1)},
      none{kNoRepresentative};
  EXPECT_THROW(writer.finish({.level = 0,
                              .positions = positions,
                              .payload = payload,
                              .children = {},
                              .first = first,
                              .order = order,
                              .representatives = none,
                              .summaries = {}}),
               Error);
}

}  // namespace
}  // namespace terrace::stream
