// SPDX-License-Identifier: Apache-2.0
// LAZ chunks, chunk tables and LASzip VLRs are refused with Corrupt, or decoded within bounds, with
// the same result in steps as at once. Decoded records are encoded again and must round-trip.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "terrace/stream/laz.hpp"

namespace {

using namespace terrace::stream::laz;
using Records = std::vector<std::byte>;

void require(bool condition) {
  if (!condition) std::abort();
}

constexpr std::array<std::size_t, 11> kLengths{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};

std::optional<Records> decoded(Decoder& decoder, std::span<const std::byte> chunk,
                               std::size_t size) {
  Records records(size);
  try {
    decoder.decode_chunk(chunk, records);
  } catch (const Corrupt& error) {
    require(error.offset() <= chunk.size());
    return std::nullopt;
  }
  return records;
}

std::optional<Records> decoded_in_steps(Decoder& decoder, std::span<const std::byte> chunk,
                                        std::size_t size, std::size_t length) {
  constexpr std::size_t kRoom = 5;
  Records records(size);
  std::size_t used = 0, done = 0;
  try {
    for (decoder.start(size / length); done < size;) {
      const auto out = std::span(records).subspan(done, std::min(kRoom * length, size - done));
      const Decoder::Step step = decoder.step(chunk.subspan(used), true, out);
      require(step.points > 0 && step.points * length <= out.size());
      used += step.bytes;
      require(used <= chunk.size());
      done += step.points * length;
    }
  } catch (const Corrupt& error) {
    require(error.offset() <= chunk.size());
    return std::nullopt;
  }
  if (used < chunk.size()) return std::nullopt;
  return records;
}

/// The codecs of a point format, version and number of extra bytes. They are reused for further
/// inputs, which must not make a difference.
struct Coders {
  explicit Coders(const Vlr& vlr)
      : length(vlr.record_length()), all(vlr), few(vlr, kZ | kGpsTime | kRgb), encoder(vlr) {}

  std::size_t length;
  Decoder all, few;
  Encoder encoder;
};

Coders& coders(unsigned format, unsigned choice) {
  static std::map<std::pair<unsigned, unsigned>, Coders> cache;
  const auto known = cache.find({format, choice});
  if (known != cache.end()) return known->second;
  Vlr vlr = Vlr::of(format, kLengths[format] + choice % 4);
  for (Item& item : vlr.items) {
    if (item.type != ItemType::wave_packet13) {
      item.version = static_cast<std::uint16_t>((format < 6 ? 1 : 3) + choice / 4);
    }
  }
  return cache.try_emplace({format, choice}, vlr).first->second;
}

void fuzz_chunk(std::span<const std::byte> bytes, unsigned format, unsigned choice) {
  auto& [length, all, few, encoder] = coders(format, choice % 8);
  const std::size_t size = (choice / 8 + 1) * length;
  const auto records = decoded(all, bytes, size);
  require(decoded_in_steps(all, bytes, size, length) == records);
  // A decoder of fewer attributes must not refuse more.
  require(decoded(few, bytes, size).has_value() || !records);
  if (!records) return;
  std::vector<std::byte> again;
  encoder.encode_chunk(*records, again);
  require(decoded(all, again, size) == records);
}

void fuzz_table(std::span<const std::byte> bytes, bool variable) {
  Vlr vlr = Vlr::of(1, 28, variable ? Vlr::kVariable : 100);
  std::uint32_t points = 0, size = 0;
  if (bytes.size() < 8) return;
  std::memcpy(&points, bytes.data(), 4);
  std::memcpy(&size, bytes.data() + 4, 4);
  points %= 1'000'000;
  size %= 100'000'000;
  try {
    const std::vector<Chunk> chunks = read_chunk_table(bytes.subspan(8), vlr, points, size);
    std::uint64_t sum = 0;
    for (const Chunk& chunk : chunks) sum += chunk.points;
    require(sum == points);
    require(read_chunk_table(write_chunk_table(chunks, vlr), vlr, points,
                             chunks.empty() ? 0 : chunks.back().offset + chunks.back().bytes) ==
            chunks);
  } catch (const Corrupt& error) {
    require(error.offset() <= bytes.size());
  }
}

void fuzz_vlr(std::span<const std::byte> bytes, unsigned format, unsigned extra) {
  const std::size_t length = kLengths[format] + extra;
  try {
    const Vlr vlr = Vlr::parse(bytes, format, length);
    require(vlr.record_length() == length);
    require(Vlr::parse(vlr.serialise(), format, length).items == vlr.items);
    if (vlr.compressor != Compressor::none) Decoder{vlr};
  } catch (const Corrupt& error) {
    require(error.offset() <= bytes.size());
  }
}

}  // namespace

/// The first byte selects what the bytes from the third on are: a chunk of a point format, a table
/// or a VLR. The second byte selects extra bytes, version and number of points.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const unsigned what = data[0] % 24, choice = data[1];
  const auto bytes = std::as_bytes(std::span(data + 2, size - 2));
  if (what < 11) {
    fuzz_chunk(bytes, what, choice);
  } else if (what < 13) {
    fuzz_table(bytes, what == 12);
  } else {
    fuzz_vlr(bytes, what - 13, choice % 8);
  }
  return 0;
}
