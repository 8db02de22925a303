// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <numeric>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "stand_in_hierarchy.hpp"
#include "store/codec/column.hpp"
#include "store/codec/split.hpp"
#include "store/codec/tables.hpp"
#include "store/read/directory.hpp"
#include "store/read/index_page.hpp"
#include "store_inputs.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/store.hpp"

namespace terrace::stream::store {
namespace {

using Random = std::mt19937_64;

/// Returns a number of up to max_bits bits; every number of bits is equally likely.
std::uint64_t any_number(Random& random, unsigned max_bits) {
  const auto bits = static_cast<unsigned>(random() % (max_bits + 1));
  return bits == 0 ? 0 : random() >> (64 - bits);
}

TEST(StoreCodec, ClassesContainTheirNumbers) {
  Random random(1);
  for (int i = 0; i < 100000; ++i) {
    const std::uint64_t number = any_number(random, 64);
    const unsigned number_class = class_of(number);
    ASSERT_LT(number_class, kClasses);
    const ClassRange range = kClassRange[number_class];
    EXPECT_LE(range.base, number);
    EXPECT_LT((number - range.base) >> range.bits, 1u) << number;
  }
}

/// Returns tables of contexts with some symbols, from rare to nearly the only one.
std::vector<Frequencies> some_frequencies(Random& random, std::size_t contexts) {
  std::vector<Frequencies> result;
  for (std::size_t c = 0; c < contexts; ++c) {
    std::array<std::uint32_t, kSymbols> counts{};
    for (unsigned s = 0; s < kClasses; ++s) {
      if (random() % 2 == 0) counts[s] = static_cast<std::uint32_t>(any_number(random, 20));
    }
    result.push_back(normalised(counts));
  }
  return result;
}

struct BothTables {
  explicit BothTables(const std::vector<Frequencies>& frequencies) : decode(frequencies.size()) {
    for (std::size_t c = 0; c < frequencies.size(); ++c) {
      encode.append(frequencies[c]);
      fill_decode_table(frequencies[c], decode[c]);
    }
    for (const DecodeTable& table : decode) pointers.push_back(&table);
  }
  EncodeTables encode;
  std::vector<DecodeTable> decode;
  std::vector<const DecodeTable*> pointers;
};

Bytes padded(const Bytes& bytes) {
  Bytes result(kPadding);
  result.insert(result.end(), bytes.begin(), bytes.end());
  result.resize(result.size() + kPadding);
  return result;
}
ByteView inside(const Bytes& bytes) {
  return ByteView(bytes).subspan(kPadding, bytes.size() - 2 * kPadding);
}

TEST(StoreCodec, RoundTripsSymbolsOfSeveralClustersTogetherAndAlone) {
  Random random(2);
  for (int round = 0; round < 200; ++round) {
    SCOPED_TRACE(round);
    const BothTables tables(some_frequencies(random, 5));
    struct Item {
      unsigned context, symbol;
      std::uint64_t value;
      unsigned bits;
    };
    const std::size_t n = 1 + random() % SymbolEncoder::kBatch;
    std::vector<std::vector<Item>> items(n);
    std::vector<SymbolEncoder> coders(n, SymbolEncoder(tables.encode));
    std::vector<std::uint32_t> last(n);
    std::vector<Bytes> alone(n);
    for (std::size_t k = 0; k < n; ++k) {
      items[k].resize(1 + random() % (round % 4 == 0 ? 4 : 2000));
      const bool raw = random() % 2 == 0;
      coders[k].start();
      for (Item& item : items[k]) {
        item.context = static_cast<unsigned>(random() % tables.encode.contexts());
        item.symbol = static_cast<unsigned>(random() % kClasses);
        // Without raw bits, only symbols that do not need the escape.
        while (!raw && tables.encode.entries()[item.context * kSymbols + item.symbol] == 0) {
          item.symbol = static_cast<unsigned>(random() % kClasses);
        }
        item.bits = raw ? static_cast<unsigned>(random() % 65) : 0;
        item.value = item.bits == 0 ? 0 : random() >> (64 - item.bits);
        coders[k].symbol(item.context, item.symbol);
        coders[k].raw(item.value, item.bits);
      }
      last[k] = static_cast<std::uint32_t>(random() % kLow);
      coders[k].finish(last[k], alone[k]);
    }
    Bytes together;
    std::vector<std::uint32_t> sizes = last;
    SymbolEncoder::finish(coders, sizes, together);
    Bytes expected;
    for (std::size_t k = 0; k < n; ++k) {
      expected.insert(expected.end(), alone[k].begin(), alone[k].end());
      ASSERT_EQ(sizes[k], alone[k].size());
    }
    ASSERT_EQ(together, expected);
    for (std::size_t k = 0; k < n; ++k) {
      const Bytes bytes = padded(alone[k]);
      SymbolDecoder decoder(tables.pointers, inside(bytes));
      for (const Item& item : items[k]) {
        ASSERT_EQ(decoder.symbol(item.context), item.symbol);
        ASSERT_EQ(decoder.raw(item.bits), item.value);
      }
      EXPECT_EQ(decoder.finish(), last[k]);
    }
  }
}

/// Encoding many numbers at once gives the same bytes as one by one, including escapes and raw
/// bits.
TEST(StoreCodec, NumbersAtOnceEqualNumbersOneByOne) {
  Random random(4);
  for (int round = 0; round < 500; ++round) {
    SCOPED_TRACE(round);
    constexpr unsigned kContexts = 6, kFirst = 2;
    const BothTables tables(some_frequencies(random, kContexts));
    const auto n = static_cast<std::uint32_t>(1 + random() % 200);
    const unsigned max_bits = round % 3 == 0 ? 3 : round % 3 == 1 ? 20 : 64;
    std::vector<std::int64_t> differences(n);
    std::vector<std::uint64_t> numbers(n);
    std::vector<std::uint8_t> classes(n);
    std::vector<std::uint32_t> slots(n);
    for (std::int64_t& difference : differences) {
      difference = static_cast<std::int64_t>(any_number(random, max_bits));
      if (random() % 2 == 0) difference = wrapped_difference(0, difference);
    }
    classify(differences.data(), numbers.data(), classes.data(), n);
    SymbolEncoder one_by_one(tables.encode), at_once(tables.encode);
    Counts counts_one_by_one(kContexts), counts_at_once(kContexts);
    SymbolCounter counter_one_by_one(counts_one_by_one), counter_at_once(counts_at_once);
    one_by_one.start();
    at_once.start();
    for (std::uint32_t i = 0; i < n; ++i) {
      ASSERT_EQ(numbers[i], zigzag(differences[i]));
      ASSERT_EQ(classes[i], class_of(numbers[i]));
      const auto context = static_cast<unsigned>(random() % (kContexts - kFirst));
      slots[i] = context * kSymbols + classes[i];
      std::uint64_t number = numbers[i];
      code_number(one_by_one, kFirst + context, number);
      code_number(counter_one_by_one, kFirst + context, number);
    }
    at_once.numbers(kFirst, numbers, classes.data(), slots.data());
    counter_at_once.numbers(kFirst, numbers, classes.data(), slots.data());
    Bytes bytes_one_by_one, bytes_at_once;
    one_by_one.finish(5, bytes_one_by_one);
    at_once.finish(5, bytes_at_once);
    ASSERT_EQ(bytes_at_once, bytes_one_by_one);
    ASSERT_EQ(counts_at_once, counts_one_by_one);
    ASSERT_EQ(counter_at_once.raw_bits(), counter_one_by_one.raw_bits());
  }
}

TEST(StoreCodec, RoundTripsPointsInBoxesOfAllSizes) {
  Random random(3);
  for (int round = 0; round < 2000 / TERRACE_TEST_SHARE; ++round) {
    SCOPED_TRACE(round);
    // Boxes up to 2^16 wide are coded by other code than larger ones.
    std::array<std::uint64_t, 3> size{};
    const unsigned max_bits = round % 3 == 0 ? 63 : round % 3 == 1 ? 16 : 4;
    for (std::uint64_t& side : size) {
      side =
          round % 5 == 0 ? std::uint64_t{65535} + random() % 3 : 1 + any_number(random, max_bits);
    }
    const auto n = static_cast<std::uint32_t>(1 + any_number(random, 9));
    std::array<std::vector<std::uint64_t>, 3> at;
    for (std::uint32_t i = 0; i < n; ++i) {
      const bool twin = i > 0 && random() % 4 == 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        // Includes corners.
        const std::uint64_t place = random() % 8 == 0 ? size[axis] - 1 : random() % size[axis];
        at[axis].push_back(twin ? at[axis][i - 1] : place);
      }
    }
    const BothTables tables(some_frequencies(random, context::kHeight));
    SymbolEncoder coder(tables.encode);
    coder.start();
    std::vector<std::uint32_t> order(n);
    SplitEncoder().encode(
        coder, size, [&](std::size_t axis, std::uint32_t i) { return at[axis][i]; }, n,
        order.data());
    coder.symbol(0, 0);  // there may be no points
    Bytes bytes;
    coder.finish(0, bytes);
    bytes = padded(bytes);

    std::array<std::vector<std::uint64_t>, 3> decoded;
    for (std::vector<std::uint64_t>& axis : decoded) axis.resize(n);
    SymbolDecoder decoder(tables.pointers, inside(bytes));
    SplitDecoder().decode(decoder, {{0, 0, 0}, size},
                          {decoded[0].data(), decoded[1].data(), decoded[2].data()}, n);
    ASSERT_EQ(decoder.symbol(0), 0u);
    ASSERT_EQ(decoder.finish(), 0u);
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        ASSERT_EQ(decoded[axis][i], at[axis][order[i]]);
      }
      const auto place = [&](std::uint32_t k) {
        return std::tuple(decoded[0][k], decoded[1][k], decoded[2][k]);
      };
      if (i > 0 && place(i) == place(i - 1)) {
        ASSERT_LT(order[i - 1], order[i]);
      }
    }
    std::sort(order.begin(), order.end());
    for (std::uint32_t i = 0; i < n; ++i) ASSERT_EQ(order[i], i);
  }
}

TEST(StoreCodec, FewSymbolsTakeFewBytes) {
  std::array<std::uint32_t, kSymbols> counts{};
  counts[1] = 1000;
  counts[2] = 1;
  const BothTables tables({normalised(counts)});
  for (const auto& [symbols, last, size] :
       {std::tuple<unsigned, std::uint32_t, std::size_t>{1, 0, 1},
        {200, 0, 1},
        {20, 5, 1},
        {20, 300, 2},
        {1, 60000, 2},
        {1, 65535, 3}}) {
    SCOPED_TRACE(symbols);
    SymbolEncoder coder(tables.encode);
    coder.start();
    for (unsigned i = 0; i < symbols; ++i) coder.symbol(0, 1);
    Bytes bytes;
    coder.finish(last, bytes);
    EXPECT_EQ(bytes.size(), size);
    const Bytes room = padded(bytes);
    SymbolDecoder decoder(tables.pointers, inside(room));
    for (unsigned i = 0; i < symbols; ++i) ASSERT_EQ(decoder.symbol(0), 1u);
    EXPECT_EQ(decoder.finish(), last);
  }
  EXPECT_THROW(SymbolDecoder(tables.pointers, ByteView()), Damage);
}

TEST(StoreCodec, RefusesALastStateAbove65535WithoutRawBits) {
  std::array<std::uint32_t, kSymbols> counts{};
  counts[1] = 1;
  const BothTables tables({normalised(counts)});
  const Bytes good = padded({5, 0, 0, 0}), bad = padded({5, 0, 1, 0});
  EXPECT_EQ(SymbolDecoder(tables.pointers, inside(good)).finish(), 5u);
  EXPECT_THROW(static_cast<void>(SymbolDecoder(tables.pointers, inside(bad)).finish()), Damage);
}

/// Entries of every kind are read back from a page, with ranges possibly widened. Truncated and
/// trailing bytes are detected, unless an escape happens to select a class with that many more
/// bits.
TEST(StoreCodec, RoundTripsIndexPages) {
  Random random(10);
  int accepted = 0;
  for (int round = 0; round < 300 / TERRACE_TEST_SHARE; ++round) {
    SCOPED_TRACE(round);
    Schema schema;
    for (const ScalarType type : {ScalarType::u8, ScalarType::f32, ScalarType::i64}) {
      if (round % 2 == 0) schema.attributes.push_back({.name = "a", .type = type});
    }
    const Layout layout(schema, round % 3 == 0 ? 0 : 1);
    Tables tables;
    tables.kinds.assign(layout.columns(), ColumnKind::plain);
    tables.frequencies = some_frequencies(random, layout.contexts());
    const unsigned wide = round % 5 == 0 ? 64 : 12;
    const auto shift = static_cast<unsigned>(random() % 4);
    std::vector<Entry> entries(1 + random() % layout.page_clusters());
    std::vector<KeyRange> ranges;
    for (Entry& entry : entries) {
      entry.bytes = static_cast<std::uint32_t>(any_number(random, 30));
      entry.points = static_cast<std::uint32_t>(any_number(random, 20));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        entry.forms[axis] = static_cast<NumberForm>(random() % kNumberForms);
        entry.low[axis] = static_cast<std::int64_t>(any_number(random, wide) << shift);
        entry.size[axis] = (1 + any_number(random, wide - shift - 1)) << shift;
      }
      entry.error = static_cast<std::uint16_t>(any_number(random, 15));
      entry.descendants = any_number(random, 48);
      entry.checksum = static_cast<std::uint16_t>(random());
      for (std::size_t a = 0; a < schema.attributes.size(); ++a) {
        KeyRange range{attribute_key(static_cast<std::int64_t>(any_number(random, 40))), 0};
        range.high = range.low + any_number(random, 40);
        ranges.push_back(range);
      }
    }
    Bytes bytes;
    const std::uint64_t offset = any_number(random, 50);
    PageContent{offset, PageColumns(entries), RangeColumns(ranges, layout.attributes)}.write(
        layout, EncodingTables(tables), bytes);
    ASSERT_LE(bytes.size(), max_page_bytes(layout.attributes.size()));
    const DecodingTables decoding(tables);
    const auto n = static_cast<std::uint32_t>(entries.size());
    const IndexPage page(bytes, n, layout, decoding);
    EXPECT_EQ(page.offset(0), offset);
    const RangeColumns decoded = page.ranges(layout, decoding);
    for (std::uint32_t i = 0; i < n; ++i) {
      const Entry entry = page.entry(i), &wanted = entries[i];
      ASSERT_EQ(entry.bytes, wanted.bytes);
      ASSERT_EQ(entry.points, wanted.points);
      ASSERT_EQ(entry.forms, wanted.forms);
      ASSERT_EQ(entry.low, wanted.low);
      ASSERT_EQ(entry.size, wanted.size);
      ASSERT_EQ(entry.error, wanted.error);
      ASSERT_EQ(entry.descendants, wanted.descendants);
      ASSERT_EQ(entry.checksum, wanted.checksum);
      for (std::size_t a = 0; a < layout.attributes.size(); ++a) {
        const KeyRange before = ranges[i * layout.attributes.size() + a],
                       after = decoded.range(i, a);
        ASSERT_LE(after.low, before.low);
        ASSERT_GE(after.high, before.high);
      }
    }
    for (const bool longer : {false, true}) {
      Bytes wrong(bytes.begin(), bytes.end() - 2);
      wrong.resize(longer ? wrong.size() + 1 : wrong.size() - 1);
      put(wrong, crc16(wrong));
      try {
        const IndexPage damaged(wrong, n, layout, decoding);
        static_cast<void>(damaged.ranges(layout, decoding));
        ++accepted;
      } catch (const Damage&) {
      }
    }
  }
  EXPECT_LT(accepted, 10);
}

/// A stored box contains the original box, whatever the outer box, and is only a little larger.
template <class Box>
void check_stored_boxes() {
  Random random(11);
  constexpr double kMax = std::numeric_limits<double>::max();
  for (int round = 0; round < 3000; ++round) {
    SCOPED_TRACE(round);
    const double scale = round % 4 == 0 ? kMax : round % 4 == 1 ? 1e-300 : 6000;
    const auto any = [&] { return (static_cast<double>(random() >> 11) * 0x1p-52 - 1) * scale; };
    Box3 bounds, box;
    for (int i = 0; i < (round % 7 == 0 ? 1 : 2); ++i) bounds.include(Point3{any(), any(), any()});
    for (int i = 0; i < 2; ++i) {
      Point3 p{any(), any(), any()};
      for (std::size_t a = 0; a < 3; ++a) p[a] = std::clamp(p[a], bounds.min[a], bounds.max[a]);
      box.include(p);
    }
    const Box3 rounded = Box::around(box, bounds).in(bounds);
    EXPECT_TRUE(rounded.contains(box.min) && rounded.contains(box.max));
    EXPECT_TRUE(bounds.contains(rounded.min) && bounds.contains(rounded.max));
    for (std::size_t a = 0; a < 3; ++a) {
      const double step = (bounds.max[a] / Box::kMax - bounds.min[a] / Box::kMax) * 1.001;
      EXPECT_LE(box.min[a] - rounded.min[a], step);
      EXPECT_LE(rounded.max[a] - box.max[a], step);
    }
  }
}
TEST(StoreCodec, BoxesOfChaptersContainTheirPages) { check_stored_boxes<ChapterBox>(); }
TEST(StoreCodec, BoxesOfPagesContainTheirClusters) { check_stored_boxes<PageBox>(); }

/// Columns along the lines of a guide round-trip in every kind, with differences that wrap, that
/// have a common divisor, or that are all 0.
TEST(StoreCodec, RoundTripsColumnsAlongLinesInEveryKind) {
  Random random(9);
  const BothTables tables(some_frequencies(random, 2 * context::kPerAttribute));
  constexpr unsigned kOther = context::kPerAttribute;
  for (int round = 0; round < 3000; ++round) {
    SCOPED_TRACE(round);
    const auto n = static_cast<std::uint32_t>(1 + random() % 60);
    const auto kind = static_cast<ColumnKind>(random() % kColumnKinds);
    const auto guide_kind = random() % 2 == 0 ? ColumnKind::plain : ColumnKind::recent;
    const unsigned wide = random() % 2 == 0 ? 64 : 20;
    const auto multiple = static_cast<std::int64_t>(random() % 3 == 0 ? 257 : 1);
    std::vector<std::int64_t> guide(n), before(n), values(n);
    std::int64_t time = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint64_t step = random() % 4;
      const std::uint64_t by = step == 0 ? 0 : step < 3 ? any_number(random, 6) : random() >> 20;
      time = wrapped_sum(time, static_cast<std::int64_t>(random() % 3 == 0 ? 0 - by : by));
      guide[i] = time;
      const auto any = [&] { return static_cast<std::int64_t>(any_number(random, wide)); };
      before[i] = any();
      values[i] = wrapped_product(random() % 2 == 0 && i > 0 ? values[i - 1] : any(), multiple);
    }
    SymbolEncoder encoder(tables.encode);
    encoder.start();
    Lines lines;
    ColumnScratch scratch;
    scratch.resize(n);
    std::vector<std::int64_t> guide_in = guide, values_in = values;
    code_guide(encoder, 0, guide_kind, nullptr, lines, 100, guide_in.data(), &scratch, n);
    code_column(encoder, kOther, kind, nullptr, &lines, before.data(), values_in.data(), &scratch,
                n);
    Bytes bytes;
    encoder.finish(7, bytes);
    const Bytes room = padded(bytes);
    SymbolDecoder decoder(tables.pointers, inside(room));
    Lines lines_out;
    std::vector<std::int64_t> guide_out(n), values_out(n);
    code_guide(decoder, 0, guide_kind, nullptr, lines_out, 0, guide_out.data(), nullptr, n);
    code_column(decoder, kOther, kind, nullptr, &lines_out, before.data(), values_out.data(),
                nullptr, n);
    EXPECT_EQ(decoder.finish(), 7u);
    ASSERT_EQ(guide_out, guide);
    ASSERT_EQ(values_out, values);
    for (std::uint32_t i = 1; i < n; ++i) ASSERT_EQ(lines_out[i], lines[i]);
  }
}

std::string content(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(StoreCodec, BytesDoNotDependOnThreads) {
  std::vector<std::vector<Point3>> blocks;
  for (int b = 0; b < 150; ++b) blocks.push_back(testing::scan_patch(b, 100));
  testing::StandInHierarchy::Options options;
  options.cluster_points = 10;
  const std::vector<RawBlock> recorded = testing::recorded_hierarchy(blocks, options);
  const TempFolder folder;
  const auto write = [&](const char* name, unsigned threads) {
    StoreWriter writer(folder.path() / name, {}, false, threads);
    for (std::size_t b = 0; b + 1 < recorded.size(); ++b) {
      writer.append(writer.encode(recorded[b].view()));
    }
    writer.finish(recorded.back().view());
  };
  write("one", 1);
  write("three", 3);
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path() / "one")) {
    const std::filesystem::path name = entry.path().filename();
    EXPECT_EQ(content(entry.path()), content(folder.path() / "three" / name)) << name;
    ++files;
  }
  EXPECT_GE(files, 5u);
}

}  // namespace
}  // namespace terrace::stream::store
