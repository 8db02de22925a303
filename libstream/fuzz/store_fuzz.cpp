// SPDX-License-Identifier: Apache-2.0
// The parsers of a store: a cluster's bytes under given tables, tables, an index page, a manifest.
// The first byte chooses. Whatever comes must be refused with Damage or Error, or be consistent.
#include <cassert>
#include <cstdint>
#include <cstdlib>
#include <string>

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
  for (const ScalarType type : {ScalarType::u8, ScalarType::f32, ScalarType::f64}) {
    schema.attributes.push_back({std::string(name_of(type)), type, 1.0, 0.0, {}});
  }
  return schema;
}

/// Frequencies in which everything is likely, so that bytes reach far into the decoder. The levels
/// have the same contexts.
Tables even_tables(unsigned contexts) {
  Tables tables;
  std::array<std::uint32_t, kSymbols> counts{};
  for (unsigned s = 0; s < 40; ++s) counts[s] = 40 - s;
  tables.frequencies.assign(contexts, normalised(counts));
  return tables;
}

void decode_cluster(ByteReader in, bool grid, unsigned level) {
  const Layout layout(schema_for(grid), level);
  static const DecodingTables tables(even_tables(layout.contexts()));
  Entry entry;
  entry.points = in.get<std::uint16_t>() % 4096u;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    entry.forms[axis] = static_cast<NumberForm>(in.get<std::uint8_t>() % kNumberForms);
    const unsigned bits = in.get<std::uint8_t>() % 64;
    entry.low[axis] = static_cast<std::int64_t>(in.get<std::uint64_t>());
    entry.size[axis] = 1 + (in.get<std::uint64_t>() >> bits) / 2;
  }
  const ByteView rest = in.take(in.left());
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

void read_page(ByteReader in) {
  const std::uint32_t clusters = 1 + in.get<std::uint8_t>() % kPageClusters;
  const ByteView rest = in.take(in.left());
  Bytes bytes(rest.begin(), rest.end());
  put(bytes, crc32(bytes));  // nobody guesses a checksum: the parser behind it is the target
  const IndexPage page(std::move(bytes), clusters);
  for (std::uint32_t i = 0; i < clusters; ++i) static_cast<void>(page.entry(i));
  static_cast<void>(page.end());
}

void read_tables(ByteReader in) {
  const Layout layout(schema_for(true), 0);
  const Tables tables = Tables::read(in.take(in.left()), layout.contexts());
  const DecodingTables decoding(tables);
  Bytes again;
  tables.write(again);
  const Tables second = Tables::read(again, layout.contexts());
  require(second.frequencies == tables.frequencies);
  require(second.predictor.coefficients == tables.predictor.coefficients);
}

/// Nobody guesses a checksum: the parser behind it is the target.
void mend_manifest(std::string& text) {
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
    switch (data[0] % 6) {
      case 0:
        decode_cluster(rest, true, 0);
        break;
      case 1:
        decode_cluster(rest, false, 0);
        break;
      case 2:
        decode_cluster(rest, true, 2);
        break;
      case 3:
        read_page(rest);
        break;
      case 4:
        read_tables(rest);
        break;
      default: {
        std::string text(reinterpret_cast<const char*>(data + 1), size - 1);
        mend_manifest(text);
        const Manifest manifest = parse_manifest(text, "manifest.json");
        // Written again it is the same, with its keys in order.
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
