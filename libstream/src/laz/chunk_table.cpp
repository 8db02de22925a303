// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

#include "laz/coder.hpp"
#include "laz/integer_coder.hpp"
#include "terrace/stream/laz.hpp"

namespace terrace::stream::laz {
namespace {

constexpr std::size_t kTableHead = 8;  // version, number of chunks
constexpr std::uint64_t kMax = 0xffffffff;

/// Codes a number of a table, given the previous one. Context 0: points, 1: bytes.
template <class Coder>
std::uint32_t code_entry(Coder& coder, IntegerModels<32, 2>& models, std::uint32_t previous,
                         std::uint64_t value, unsigned context) {
  coder.reserve();
  return static_cast<std::uint32_t>(models.code(coder, static_cast<std::int32_t>(previous),
                                                static_cast<std::int32_t>(value), context));
}

}  // namespace

std::vector<Chunk> read_chunk_table(std::span<const std::byte> table, const Vlr& vlr,
                                    std::uint64_t points, std::uint64_t bytes) {
  const auto* begin = reinterpret_cast<const std::uint8_t*>(table.data());
  if (table.size() < kTableHead) throw Corrupt("the chunk table is too short", table.size());
  if (load<std::uint32_t>(begin) != 0) throw Corrupt("the chunk table's version is unknown", 0);
  const std::uint32_t count = load<std::uint32_t>(begin + 4);
  // A chunk has at least its first record and the beginning of a stream; a chunk without points may
  // follow the last.
  if (count > bytes / (vlr.record_length() + kStreamEnds) + 1) {
    throw Corrupt("the chunk table has more chunks than the file has room for", 4);
  }
  std::vector<Chunk> chunks;
  std::uint64_t points_so_far = 0, offset = 0;
  if (count > 0) {
    const auto models = make_zeroed<IntegerModels<32, 2>>(1);
    CodedBytes coded;
    SymbolDecoder coder;
    coder.begin(coded, {begin + kTableHead, table.size() - kTableHead}, kTableHead, 1);
    const bool variable = vlr.chunk_size == Vlr::kVariable;
    std::uint32_t chunk_points = 0, chunk_bytes = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (variable) {
        chunk_points = code_entry(coder, models[0], chunk_points, 0, 0);
      } else {
        const std::uint64_t remaining = points - points_so_far;
        chunk_points =
            static_cast<std::uint32_t>(std::min<std::uint64_t>(vlr.chunk_size, remaining));
      }
      chunk_bytes = code_entry(coder, models[0], chunk_bytes, 0, 1);
      if (chunk_points > points - points_so_far || chunk_bytes > bytes - offset) {
        throw Corrupt("the chunk table's sums are larger than the file",
                      kTableHead + coder.offset());
      }
      if (chunk_points > 0) {
        chunks.push_back({.offset = offset, .bytes = chunk_bytes, .points = chunk_points});
      }
      points_so_far += chunk_points;
      offset += chunk_bytes;
    }
    coder.check_used(true);
  }
  if (points_so_far != points || offset != bytes) {
    throw Corrupt("the chunk table's sums are smaller than the file", kTableHead);
  }
  return chunks;
}

std::vector<std::byte> write_chunk_table(std::span<const Chunk> chunks, const Vlr& vlr) {
  const bool variable = vlr.chunk_size == Vlr::kVariable;
  if (chunks.size() > kMax) throw std::invalid_argument("a chunk table holds 2^32 - 1 chunks");
  std::vector<std::uint8_t> coded;
  if (!chunks.empty()) {
    const auto models = make_zeroed<IntegerModels<32, 2>>(1);
    SymbolEncoder coder;
    coder.begin(coded, 1);
    Chunk previous;
    for (const Chunk& chunk : chunks) {
      const bool is_last = &chunk == &chunks.back();
      if (chunk.points > kMax || chunk.bytes > kMax ||
          (!variable &&
           (chunk.points > vlr.chunk_size || (!is_last && chunk.points != vlr.chunk_size)))) {
        throw std::invalid_argument(
            "a chunk has more points or bytes than a chunk table can store");
      }
      if (variable) {
        code_entry(coder, models[0], static_cast<std::uint32_t>(previous.points), chunk.points, 0);
      }
      code_entry(coder, models[0], static_cast<std::uint32_t>(previous.bytes), chunk.bytes, 1);
      previous = chunk;
    }
    coder.finish();
  }
  std::vector<std::byte> table(kTableHead + coded.size());
  auto* bytes = reinterpret_cast<std::uint8_t*>(table.data());
  store(bytes, std::uint32_t{0});
  store(bytes + 4, static_cast<std::uint32_t>(chunks.size()));
  std::copy(coded.begin(), coded.end(), bytes + kTableHead);
  return table;
}

}  // namespace terrace::stream::laz
