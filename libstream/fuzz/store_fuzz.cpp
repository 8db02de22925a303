// SPDX-License-Identifier: Apache-2.0
// The parsers of a store, of which the first byte selects one: a cluster's bytes with given tables,
// tables, an index page, a manifest. All input must be refused with Damage or Error, or be
// consistent.
#include <cassert>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "store/manifest.hpp"
#include "store/read/cluster_decoder.hpp"
#include "store/read/index_page.hpp"
#include "terrace/stream/error.hpp"

namespace {

using namespace terrace::stream;
using namespace terrace::stream::store;

void require(bool condition) {
  if (!condition) std::abort();
}

StoreSchema schema_for(bool grid) {
  StoreSchema schema;
  schema.grid = grid;
  // A column of kind `preceding` needs a preceding column of integers.
  for (const ScalarType type :
       {ScalarType::u64, ScalarType::i16, ScalarType::u8, ScalarType::f32, ScalarType::f64}) {
    schema.attributes.push_back({std::string(name_of(type)), type, 1.0, 0.0, {}});
  }
  return schema;
}

/// Returns tables in which every symbol is likely, so that input reaches far into the decoder. All
/// levels have the same contexts. The first attribute may be the guide.
Tables even_tables(const Layout& layout, ColumnKind kind, bool guided) {
  Tables tables;
  if (guided) tables.guide.attribute = 0;
  for (unsigned c = 0; c < layout.columns(); ++c) {
    const bool possible = c == tables.guide.attribute ? kind == ColumnKind::recent
                                                      : along_line(kind) != ColumnKind::preceding ||
                                                            layout.may_use_preceding(c);
    tables.kinds.push_back(possible ? kind : ColumnKind::plain);
  }
  std::array<std::uint32_t, kSymbols> counts{};
  for (unsigned s = 0; s < 40; ++s) counts[s] = 40 - s;
  tables.frequencies.assign(layout.contexts(), normalised(counts));
  return tables;
}

const DecodingTables& tables_of(ColumnKind kind, bool guided) {
  static std::map<std::pair<ColumnKind, bool>, DecodingTables> cache;
  return cache.try_emplace({kind, guided}, even_tables(Layout(schema_for(false), 0), kind, guided))
      .first->second;
}

void decode_cluster(ByteReader in, bool grid, unsigned level, ColumnKind kind, bool guided) {
  const Layout layout(schema_for(grid), level);
  const DecodingTables& tables = tables_of(kind, guided);
  Entry entry;
  entry.points = in.get<std::uint16_t>() % 4096u;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    entry.forms[axis] = static_cast<NumberForm>(in.get<std::uint8_t>() % kNumberForms);
    const unsigned bits = in.get<std::uint8_t>() % 64;
    entry.low[axis] = static_cast<std::int64_t>(in.get<std::uint64_t>());
    entry.size[axis] = 1 + (in.get<std::uint64_t>() >> bits) / 2;
  }
  const ByteView rest = in.take(in.remaining());
  Bytes bytes(kPadding, 0xa5);
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  bytes.resize(bytes.size() + kPadding, 0x5a);
  entry.bytes = static_cast<std::uint32_t>(rest.size());
  ClusterDecoder decoder;
  ClusterPoints points;
  decoder.decode(layout, tables, entry, ByteView(bytes).subspan(kPadding, rest.size()),
                 /*root=*/false, points);
  require(points.size() + 1 == entry.points);
  require(points.payload.size() == points.size() * layout.payload_size);
  require(points.children.size() == points.size() * level);
}

void decode_page(ByteReader in, bool grid) {
  const Layout layout(schema_for(grid), 0);
  const DecodingTables& tables = tables_of(ColumnKind::plain, false);
  const auto clusters =
      static_cast<std::uint32_t>(1 + in.get<std::uint8_t>() % layout.page_clusters());
  const ByteView rest = in.take(in.remaining());
  Bytes bytes(rest.begin(), rest.end());
  // Sets the checksum, which a fuzzer cannot guess, to test the parser after it.
  put(bytes, crc16(bytes));
  const IndexPage page(bytes, clusters, layout, tables);
  const RangeColumns ranges = page.ranges(layout, tables);
  std::vector<Entry> entries;
  for (std::uint32_t i = 0; i < clusters; ++i) entries.push_back(page.entry(i));
  static_cast<void>(page.end(clusters - 1));
  // They are the same after rewriting.
  Bytes again;
  PageContent{page.offset(0), PageColumns(entries), ranges}.write(
      layout, EncodingTables(even_tables(layout, ColumnKind::plain, false)), again);
  const IndexPage second(again, clusters, layout, tables);
  const RangeColumns after = second.ranges(layout, tables);
  for (std::uint32_t i = 0; i < clusters; ++i) {
    const Entry entry = second.entry(i);
    require(second.offset(i) == page.offset(i) && entry.points == entries[i].points);
    require(entry.forms == entries[i].forms && entry.low == entries[i].low);
    require(entry.size == entries[i].size && entry.error == entries[i].error);
    require(entry.descendants == entries[i].descendants && entry.checksum == entries[i].checksum);
    for (std::size_t a = 0; a < layout.attributes.size(); ++a) {
      require(after.range(i, a).low == ranges.range(i, a).low);
      require(after.range(i, a).high == ranges.range(i, a).high);
    }
  }
}

void read_tables(ByteReader in) {
  const Layout layout(schema_for(true), 0);
  const Tables tables = Tables::read(in.take(in.remaining()), layout);
  const DecodingTables decoding(tables);
  Bytes again;
  tables.write(again);
  const Tables second = Tables::read(again, layout);
  require(second.guide.attribute == tables.guide.attribute);
  require(second.kinds == tables.kinds);
  require(second.frequencies == tables.frequencies);
  require(second.predictor.coefficients == tables.predictor.coefficients);
}

/// Sets the checksum, which a fuzzer cannot guess, to test the parser after it.
void update_manifest_checksum(std::string& text) {
  constexpr std::size_t kDigitsFromEnd = 12;  // eight digits, a quote, newline, brace, newline
  if (text.size() < kDigitsFromEnd) return;
  text.replace(text.size() - kDigitsFromEnd, 8, "00000000");
  const std::string checksum = hexadecimal(crc32(0, text.data(), text.size()));
  text.replace(text.size() - kDigitsFromEnd, 8, checksum);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  try {
    const ByteReader rest({data + 1, size - 1});
    switch (data[0] % 14) {
      case 0:
        decode_cluster(rest, true, 0, ColumnKind::plain, false);
        break;
      case 1:
        decode_cluster(rest, true, 2, ColumnKind::recent, false);
        break;
      case 2:
        decode_cluster(rest, false, 0, ColumnKind::plain, false);
        break;
      case 3:
        decode_cluster(rest, false, 1, ColumnKind::recent, false);
        break;
      case 4:
        decode_cluster(rest, false, 0, ColumnKind::preceding, false);
        break;
      case 6:
        decode_cluster(rest, false, 0, ColumnKind::plain, true);
        break;
      case 7:
        decode_cluster(rest, false, 0, ColumnKind::line_recent, true);
        break;
      case 8:
        decode_cluster(rest, false, 1, ColumnKind::line_preceding, true);
        break;
      case 9:
        decode_cluster(rest, false, 0, ColumnKind::line_trend, true);
        break;
      case 10:
        decode_cluster(rest, false, 0, ColumnKind::line_median, true);
        break;
      case 11:
        decode_page(rest, /*grid=*/false);
        break;
      case 12:
        decode_page(rest, /*grid=*/true);
        break;
      case 13:
        read_tables(rest);
        break;
      default: {
        std::string text(reinterpret_cast<const char*>(data + 1), size - 1);
        update_manifest_checksum(text);
        const Manifest manifest = parse_manifest(text, "manifest.json");
        // It is the same after rewriting, with its keys in order.
        const std::string again = to_text(manifest);
        const Manifest second = parse_manifest(again, "manifest.json");
        require(is_as_written(again, second));
        require(to_text(second) == again);
      }
    }
  } catch (const Damage&) {
  } catch (const Error&) {
  }
  return 0;
}
