// SPDX-License-Identifier: Apache-2.0
// Tests of the LAZ codec: LASzip's bytes for given values, and round trips of records.
#include "terrace/stream/laz.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "laz/coder.hpp"
#include "laz/integer_coder.hpp"
#include "laz/items.hpp"
#include "laz_testing.hpp"

namespace terrace::stream::laz {
namespace {

template <class T>
std::string hex(const std::vector<T>& bytes) {
  std::string text;
  for (const T byte : bytes) {
    const auto value = static_cast<unsigned>(byte);
    text += "0123456789abcdef"[value >> 4];
    text += "0123456789abcdef"[value & 15];
  }
  return text;
}

ByteVector from_hex(const std::string& text) {
  ByteVector bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
    bytes.push_back(static_cast<std::byte>(std::stoul(text.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

/// Encodes with code(coder), and calls it again with a decoder of the bytes.
template <class Code>
std::vector<std::uint8_t> coded_twice(const Code& code) {
  std::vector<std::uint8_t> bytes;
  SymbolEncoder encoder;
  encoder.begin(bytes, 1);
  code(encoder);
  encoder.finish();
  CodedBytes window;
  SymbolDecoder decoder;
  decoder.begin(window, bytes, 0, 2);
  code(decoder);
  EXPECT_EQ(decoder.offset(), bytes.size());
  return bytes;
}

TEST(LazCoder, StreamsEqualLaszips) {
  EXPECT_EQ(hex(coded_twice([](auto&) {})), "01000000");
  EXPECT_EQ(
      hex(coded_twice([](auto& coder) { EXPECT_EQ(coder.raw(32, 0x12345678), 0x12345678u); })),
      "5677bbbbee000000");
  EXPECT_EQ(hex(coded_twice([](auto& coder) {
              EXPECT_EQ(coder.raw(1, 1), 1u);
              EXPECT_EQ(coder.raw(7, 0x55), 0x55u);
              EXPECT_EQ(coder.raw(19, 0x7ffff), 0x7ffffu);
              EXPECT_EQ(coder.raw(20, 0xabcde), 0xabcdeu);
            })),
            "d5fff7a19c17a10000");
}

TEST(LazCoder, ModelsEqualLaszips) {
  SymbolModel<4> small{};
  EXPECT_EQ(hex(coded_twice([&](auto& coder) {
              unsigned at = 0;
              for (const unsigned symbol : {0u, 1u, 2u, 3u, 3u, 3u, 3u, 0u, 1u, 2u, 3u, 3u}) {
                if (at == 5) {
                  EXPECT_EQ(small.start[1], 7281);
                  EXPECT_EQ(small.start[2], 14563);
                  EXPECT_EQ(small.start[3], 21845);
                  EXPECT_EQ(small.countdown, 6u);
                }
                if (at == 11) {
                  EXPECT_EQ(small.start[3], 19660);
                }
                coder.reserve();
                EXPECT_EQ(coder.symbol(small, symbol), symbol);
                ++at;
              }
            })),
            "1bf8f0000000");
  BitModel bits{};
  EXPECT_EQ(hex(coded_twice([&](auto& coder) {
              unsigned at = 0;
              for (const unsigned bit : {0u, 1u, 1u, 0u, 1u, 0u, 0u, 0u, 0u, 0u, 0u, 1u}) {
                if (at == 4) {
                  EXPECT_EQ(bits.zero, 4095u);
                }
                if (at == 9) {
                  EXPECT_EQ(bits.zero, 5213u);
                }
                coder.reserve();
                EXPECT_EQ(coder.bit(bits, bit), bit);
                ++at;
              }
            })),
            "6821000000");
  SymbolModel<256> large{};
  const std::vector<std::uint8_t> bytes = coded_twice([&](auto& coder) {
    for (unsigned i = 0; i < 100000; ++i) {
      const unsigned symbol = i % 7 == 0 ? (37 * i) >> 3 & 255 : i % 5;
      coder.reserve();
      ASSERT_EQ(coder.symbol(large, symbol), symbol);
    }
    EXPECT_EQ(large.total, 31612u);
    EXPECT_EQ(large.start[128], 30363);
  });
  EXPECT_EQ(bytes.size(), 46434u);
  EXPECT_EQ(fnv1a(std::as_bytes(std::span(bytes))), 0x5f5c744f7ff7807bu);
}

TEST(LazCoder, IntegersEqualLaszips) {
  const auto models = make_zeroed<IntegerModels<32, 1>>(1);
  const std::array<std::int32_t, 11> values{
      0, 1, -1, 2, -2, 100, -100, 1000, -100000, 2147483647, -2147483647 - 1};
  const std::array<unsigned, 11> magnitudes{0, 0, 1, 1, 2, 7, 7, 10, 17, 31, 32};
  EXPECT_EQ(hex(coded_twice([&](auto& coder) {
              for (std::size_t i = 0; i < values.size(); ++i) {
                coder.reserve();
                EXPECT_EQ(models[0].code(coder, 0, values[i], 0), values[i]);
                EXPECT_EQ(models[0].magnitude, magnitudes[i]);
              }
            })),
            "000f7914320e0b2b7be1cfc599f591a1c3000000");
  const auto shorts = make_zeroed<IntegerModels<16, 2>>(1);
  struct Case {
    std::int32_t predicted, value;
    unsigned context, magnitude;
  };
  EXPECT_EQ(hex(coded_twice([&](auto& coder) {
              for (const Case& c :
                   {Case{0, 65535, 0, 1}, Case{65535, 0, 1, 0}, Case{100, 32868, 0, 16},
                    Case{100, 32869, 1, 15}, Case{1000, 1000, 0, 0}, Case{1000, 1500, 0, 9}}) {
                coder.reserve();
                EXPECT_EQ(shorts[0].code(coder, c.predicted, c.value, c.context), c.value);
                EXPECT_EQ(shorts[0].magnitude, c.magnitude);
              }
            })),
            "0f7da742538141bb92000000");
}

TEST(LazCoder, MedianEqualsLaszips) {
  Median5 median;
  median.begin();
  std::vector<std::int32_t> values;
  for (const std::int32_t x : {5, 3, 8, -2, 7, 7, 1, 10, 10, 10, -5}) {
    median.add(x);
    values.push_back(median.value());
  }
  EXPECT_EQ(values, (std::vector<std::int32_t>{0, 0, 3, 3, 3, 5, 5, 5, 7, 10, 10}));
}

TEST(LazChunkTable, EqualsLaszips) {
  Vlr vlr = Vlr::of(0, 20, 50000);
  std::vector<Chunk> chunks{{0, 1000, 50000}, {1000, 999, 50000}, {1999, 70, 123}};
  const std::string head = "0000000003000000";
  const ByteVector fixed = write_chunk_table(chunks, vlr);
  EXPECT_EQ(hex(fixed), head + "5522f12731000000");
  EXPECT_EQ(read_chunk_table(fixed, vlr, 100123, 2069), chunks);
  vlr.chunk_size = Vlr::kVariable;
  ByteVector variable = write_chunk_table(chunks, vlr);
  EXPECT_EQ(hex(variable), head + "82088dbbd2d072e732b20e000000");
  variable.push_back(std::byte{0x55});  // the bytes after the table belong to something else
  EXPECT_EQ(read_chunk_table(variable, vlr, 100123, 2069), chunks);

  EXPECT_EQ(hex(write_chunk_table({}, vlr)), "0000000000000000");
  EXPECT_TRUE(read_chunk_table(write_chunk_table({}, vlr), vlr, 0, 0).empty());
  // An entry without points, which some writers append.
  chunks.push_back({2069, 0, 0});
  EXPECT_EQ(read_chunk_table(write_chunk_table(chunks, vlr), vlr, 100123, 2069).size(), 3u);
}

TEST(LazChunkTable, RefusesTablesThatDoNotAddUp) {
  const Vlr vlr = Vlr::of(0, 20, 50000);
  const std::vector<Chunk> chunks{{0, 1000, 50000}, {1000, 999, 50000}, {1999, 70, 123}};
  const ByteVector table = write_chunk_table(chunks, vlr);
  EXPECT_THROW(read_chunk_table(table, vlr, 100123, 2068), Corrupt);
  EXPECT_THROW(read_chunk_table(table, vlr, 100123, 2070), Corrupt);
  EXPECT_THROW(read_chunk_table(table, vlr, 150001, 2069), Corrupt);
  for (std::size_t size = 0; size < table.size(); ++size) {
    EXPECT_THROW(read_chunk_table(std::span(table).first(size), vlr, 100123, 2069), Corrupt);
  }
  ByteVector damaged = table;
  for (std::size_t i = 4; i < 8; ++i) damaged[i] = std::byte{0xff};
  EXPECT_THROW(read_chunk_table(damaged, vlr, 100123, 2069), Corrupt);
  damaged[0] = std::byte{1};
  EXPECT_THROW(read_chunk_table(damaged, vlr, 100123, 2069), Corrupt);
  const std::vector<Chunk> uneven{{0, 1000, 49999}, {1000, 999, 50000}};
  EXPECT_THROW(write_chunk_table(uneven, vlr), std::invalid_argument);
}

TEST(LazVlr, IsReadAsWritten) {
  for (unsigned format = 0; format <= 10; ++format) {
    for (const std::size_t extra : {0u, 1u, 27u}) {
      const std::size_t length = kRecordLengths[format] + extra;
      const Vlr vlr = Vlr::of(format, length, 1000);
      EXPECT_EQ(vlr.record_length(), length);
      const ByteVector payload = vlr.serialise();
      EXPECT_EQ(payload.size(), 34 + 6 * vlr.items.size());
      const Vlr read = Vlr::parse(payload, format, length);
      EXPECT_EQ(read.compressor, vlr.compressor);
      EXPECT_EQ(read.chunk_size, 1000u);
      EXPECT_EQ(read.items, vlr.items);
      EXPECT_THROW(Vlr::parse(payload, format, length + 1), Corrupt);
      EXPECT_THROW(Vlr::parse(payload, (format + 1) % 11, length), Corrupt);
      EXPECT_THROW(Vlr::parse(std::span(payload).first(payload.size() - 1), format, length),
                   Corrupt);
    }
    EXPECT_THROW(Vlr::of(format, kRecordLengths[format] - 1), std::invalid_argument);
  }
  EXPECT_THROW(Vlr::of(11, 100), std::invalid_argument);
}

TEST(LazVlr, RefusesUnknownItems) {
  const ByteVector good = Vlr::of(3, 34).serialise();
  for (const std::size_t at : {0u, 2u, 32u, 34u, 36u, 38u}) {
    ByteVector bad = good;
    bad[at] = std::byte{9};
    EXPECT_THROW(Vlr::parse(bad, 3, 34), Corrupt) << at;
  }
  ByteVector layered = good;  // formats 0 to 5 are not layered
  layered[0] = std::byte{3};
  EXPECT_THROW(Vlr::parse(layered, 3, 34), Corrupt);
  ByteVector variable = good;  // some writers use 0 for it
  std::fill_n(variable.begin() + 12, 4, std::byte{0});
  EXPECT_EQ(Vlr::parse(variable, 3, 34).chunk_size, Vlr::kVariable);
  Vlr waves = Vlr::of(4, 57);
  waves.items[2].version = 2;  // another name for the same
  EXPECT_EQ(Vlr::parse(waves.serialise(), 4, 57).items, waves.items);
  Vlr mixed = Vlr::of(1, 28);
  mixed.items[1].version = 1;
  EXPECT_THROW(Vlr::parse(mixed.serialise(), 1, 28), Corrupt);
  EXPECT_THROW(Decoder{mixed}, std::invalid_argument);
  Vlr raw = Vlr::of(1, 28);
  raw.compressor = Compressor::none;
  EXPECT_NO_THROW(Vlr::parse(raw.serialise(), 1, 28));
  EXPECT_THROW(Decoder{raw}, std::invalid_argument);
  EXPECT_THROW(Encoder{raw}, std::invalid_argument);
}

void expect_chunk(const Vlr& vlr, const ByteVector& records, const std::string& coded) {
  const std::size_t length = vlr.record_length();
  ByteVector chunk;
  Encoder(vlr).encode_chunk(records, chunk);
  EXPECT_EQ(hex(chunk), hex(records).substr(0, 2 * length) + coded);
  ByteVector decoded(records.size());
  Decoder(vlr).decode_chunk(chunk, decoded);
  EXPECT_EQ(hex(decoded), hex(records));
}

Vlr with_version(Vlr vlr, std::uint16_t version) {
  for (Item& item : vlr.items) {
    if (item.type != ItemType::wave_packet13) item.version = version;
  }
  return vlr;
}

TEST(LazChunk, PointsOfFormat0EqualLaszips) {
  const ByteVector records = from_hex(
      "a0860100400d03002c01000032000902fb000700ac860100360d0300360100003c000902fb000700"
      "b48601002d0d0300defeffff3c001101fc030800b48601002d0d0300defeffff0000120103030800");
  const Vlr vlr = Vlr::of(0, 20);
  expect_chunk(vlr, records, "41a0b9531cca914ea2122f1abba5cabfea1a35017ad15b000000");
  expect_chunk(with_version(vlr, 1), records, "246b3774ec493cfcaeed4a1a2702097db51ea3d5b1d70000");
}

TEST(LazChunk, TimesEqualLaszips) {
  const std::array<double, 9> times{1000.0, 1000.001, 1000.002, 1000.003, 1000.003,
                                    -5.0,   1000.004, 1000.5,   1000.004};
  ByteVector records(times.size() * 28);
  for (std::size_t i = 0; i < times.size(); ++i) {
    std::byte* record = records.data() + i * 28;
    record[0] = static_cast<std::byte>(i);
    record[14] = std::byte{9};
    std::memcpy(record + 20, &times[i], sizeof(double));
  }
  expect_chunk(
      Vlr::of(1, 28), records,
      "000f7e5fb441353e011e1afec079c74f444657fb6111645a4655000000000688afc5c816a80000000000"
      "1c5272fbd38ce8a04eec680068acc5ac000000000178000000");
}

/// Appends a record of format 7.
void put_point14(ByteVector& records, std::array<std::int32_t, 3> place, std::uint16_t intensity,
                 std::uint8_t returns, std::uint8_t flags, std::uint8_t classification,
                 std::int16_t angle, std::uint16_t source, double time,
                 std::array<std::uint16_t, 3> rgb) {
  const auto put = [&records](const auto& value) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    records.insert(records.end(), bytes.begin(), bytes.end());
  };
  put(place);
  put(intensity);
  put(returns);
  put(flags);
  put(classification);
  put(std::uint8_t{0});
  put(angle);
  put(source);
  put(time);
  put(rgb);
}

TEST(LazChunk, ChannelsEqualLaszips) {
  ByteVector records;
  put_point14(records, {1000, 2000, 30}, 10, 0x11, 0x40, 2, -300, 1, 100.0, {256, 512, 768});
  put_point14(records, {1010, 2005, 31}, 12, 0x22, 0x40, 2, -300, 1, 100.0, {300, 520, 700});
  put_point14(records, {5000, 2, 31}, 12, 0x11, 0x50, 2, -300, 2, 100.5, {1, 2, 3});
  put_point14(records, {1020, 2010, 33}, 12, 0x11, 0x40, 5, -298, 1, 100.1, {310, 530, 710});
  put_point14(records, {1030, 2015, 33}, 12, 0x11, 0x40, 5, -298, 1, 100.2, {311, 531, 711});
  const auto sizes = [](const std::string& rgb) {
    return "05000000130000000700000008000000000000000600000004000000000000000400000017000000" +
           rgb + "000000";
  };
  const std::string layers =
      "0a4457fb41494a8f921736bcc7989c60fd000003e09e9e00000002020403fe000000169ab900000017000000"
      "0800000048ea5f4dc80003d257b0a33332d980d9b3542c61000000";
  const Vlr vlr = Vlr::of(7, 36);
  expect_chunk(vlr, records,
               sizes("1a") + layers + "ea592dd7ae7f58260a7d9ffff9a9a4d950c60b4d5bd401000000");
  expect_chunk(with_version(vlr, 4), records,
               sizes("17") + layers + "ea592dd7ae7f58260a7d9ffea8a5ec054ebbfc01000000");
}

/// Returns records in which each byte mostly equals that of the previous record, sometimes that of
/// another record or a random one, so that all cases of a model occur soon.
ByteVector made_records(std::size_t length, std::size_t count, unsigned wildness,
                        std::mt19937& random) {
  ByteVector records(length * count);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const auto dice = static_cast<unsigned>(random() % 100);
    const std::byte before = i < length ? std::byte{0} : records[i - length];
    records[i] = dice >= wildness ? before
                 : dice % 2 == 0  ? static_cast<std::byte>(random() % 4)
                                  : static_cast<std::byte>(random());
  }
  return records;
}

/// Returns VLRs with all items in all versions, with extra bytes.
std::vector<Vlr> all_codings() {
  std::vector<Vlr> all;
  for (unsigned format = 0; format <= 10; ++format) {
    for (const std::size_t extra : {0u, 3u}) {
      const Vlr vlr = Vlr::of(format, kRecordLengths[format] + extra);
      for (std::uint16_t version = 1; version <= 4; ++version) {
        if ((version > 2) == (format >= 6)) all.push_back(with_version(vlr, version));
      }
    }
  }
  return all;
}

/// Decodes as from a pipe, giving `feed` more bytes and requesting up to `max_points` records at a
/// time.
ByteVector decoded_in_steps(Decoder& decoder, std::span<const std::byte> chunk, std::size_t length,
                            std::size_t points, std::size_t feed, std::size_t max_points,
                            bool layered) {
  ByteVector records(points * length);
  decoder.start(points);
  std::size_t used = 0, known = 0, done = 0;
  while (done < points) {
    const std::size_t room = std::min(max_points, points - done);
    const Decoder::Step step =
        decoder.step(chunk.subspan(used, known - used), known == chunk.size(),
                     std::span(records).subspan(done * length, room * length));
    used += step.bytes;
    done += step.points;
    if (step.points == 0) {
      if (known == chunk.size()) {
        ADD_FAILURE() << "no point was decoded from all bytes";
        break;
      }
      known = std::min(known + feed, chunk.size());
    }
    if (layered && done < points) {
      EXPECT_EQ(used, 0u);
    }
  }
  EXPECT_EQ(used, chunk.size());
  return records;
}

TEST(LazChunk, RoundTripsAnyRecords) {
  std::mt19937 random(20);
  for (const Vlr& vlr : all_codings()) {
    const std::size_t length = vlr.record_length();
    const bool layered = vlr.compressor == Compressor::layered;
    Encoder encoder(vlr);
    Decoder decoder(vlr);
    for (const unsigned wildness : {0u, 3u, 30u, 100u}) {
      for (const std::size_t count : {1u, 2u, 3u, 700u}) {
        SCOPED_TRACE(testing::Message()
                     << "record of " << length << " bytes, version " << vlr.items[0].version << ", "
                     << wildness << " % wild, points " << count);
        const ByteVector records = made_records(length, count, wildness, random);
        ByteVector chunk;
        encoder.encode_chunk(records, chunk);
        ByteVector decoded(records.size());
        decoder.decode_chunk(chunk, decoded);
        ASSERT_TRUE(decoded == records);
        ASSERT_TRUE(decoded_in_steps(decoder, chunk, length, count, 1000, 7, layered) == records);
        ASSERT_TRUE(decoded_in_steps(decoder, chunk, length, count, 41, 1000, layered) == records);
        if (layered) {
          const Chunk head = layered_chunk(vlr, std::span(chunk).first(layered_head_size(vlr)));
          EXPECT_EQ(head.bytes, chunk.size());
          EXPECT_EQ(head.points, count);
        }
      }
    }
  }
}

TEST(LazChunk, RoundTripsTimesOfAllKinds) {
  std::mt19937_64 random(30);
  for (std::uint16_t version = 1; version <= 3; ++version) {
    const bool layered = version == 3;
    const std::size_t length = layered ? 30 : 28, at = layered ? 22 : 20;
    const Vlr vlr = with_version(Vlr::of(layered ? 6 : 1, length), version);
    ByteVector records(length * 3000);
    std::array<std::uint64_t, 5> sequences{};
    const std::array<std::uint64_t, 5> steps{1000, 1u << 20, 77777, 0, std::uint64_t{0} - 5000};
    for (std::size_t i = 0; i < 3000; ++i) {
      const std::size_t s = random() % 20 == 0 ? random() % 5 : i / 100 % 5;
      const std::uint64_t dice = random() % 100;
      const std::uint64_t times = dice < 70 ? 1 : dice < 90 ? random() % 20 - 12 : random() % 2000;
      sequences[s] += dice == 99 ? random() : times * steps[s] + random() % 3;
      std::memcpy(records.data() + i * length + at, &sequences[s], 8);
    }
    ByteVector chunk, decoded(records.size());
    Encoder(vlr).encode_chunk(records, chunk);
    Decoder(vlr).decode_chunk(chunk, decoded);
    EXPECT_TRUE(decoded == records) << version;
  }
}

TEST(LazChunk, OmittedLayersKeepTheFirstPointsValue) {
  struct Part {
    std::uint32_t attribute;
    std::size_t at, size;
    unsigned mask = 0xff;  ///< of a byte
  };
  const Vlr vlr = Vlr::of(10, 67 + 17);
  const std::size_t length = vlr.record_length(), count = 600;
  std::vector<Part> parts{{kZ, 8, 4},
                          {kClassification, 16, 1},
                          {kFlags, 15, 1, 0xcf},
                          {kIntensity, 12, 2},
                          {kScanAngle, 18, 2},
                          {kUserData, 17, 1},
                          {kPointSource, 20, 2},
                          {kGpsTime, 22, 8},
                          {kRgb, 30, 6},
                          {kNir, 36, 2},
                          {kWavePacket, 38, 29}};
  for (unsigned i = 0; i < 17; ++i) parts.push_back({kExtraByte0 << std::min(i, 15u), 67 + i, 1});
  std::mt19937 random(40);
  const ByteVector records = made_records(length, count, 20, random);
  ByteVector chunk;
  Encoder(vlr).encode_chunk(records, chunk);
  parts.push_back({0, 0, 0});  // X, Y, returns and channel only
  for (const Part& selected : parts) {
    ByteVector expected = records;
    for (const Part& part : parts) {
      if (part.attribute == selected.attribute) continue;
      for (std::size_t i = 1; i < count; ++i) {
        for (std::size_t b = part.at; b < part.at + part.size; ++b) {
          std::byte& byte = expected[i * length + b];
          const auto mask = static_cast<std::byte>(part.mask);
          byte = (byte & ~mask) | (records[b] & mask);
        }
      }
    }
    ByteVector decoded(records.size());
    Decoder(vlr, selected.attribute).decode_chunk(chunk, decoded);
    EXPECT_TRUE(decoded == expected) << selected.attribute;
  }
}

TEST(LazChunk, DamageOnlyCausesErrorsOrWrongValues) {
  std::mt19937 random(50);
  for (const Vlr& vlr : all_codings()) {
    const std::size_t length = vlr.record_length(), count = 12;
    SCOPED_TRACE(testing::Message()
                 << "record of " << length << " bytes, version " << vlr.items[0].version);
    const ByteVector records = made_records(length, count, 30, random);
    ByteVector chunk, decoded(records.size());
    Encoder(vlr).encode_chunk(records, chunk);
    Decoder decoder(vlr);
    for (std::size_t size = 0; size < chunk.size(); ++size) {
      // A separate buffer, so that a sanitizer detects reads beyond the end.
      const ByteVector cut(chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(size));
      EXPECT_THROW(decoder.decode_chunk(cut, decoded), Corrupt) << size;
    }
    for (std::size_t at = 0; at < chunk.size(); ++at) {
      ByteVector bad = chunk;
      bad[at] ^= static_cast<std::byte>(1u << random() % 8);
      try {
        decoder.decode_chunk(bad, decoded);
      } catch (const Corrupt& error) {
        EXPECT_LE(error.offset(), bad.size());
      }
    }
    ByteVector more = chunk;
    more.push_back(std::byte{0});
    EXPECT_THROW(decoder.decode_chunk(more, decoded), Corrupt);
    // A decoder's history does not make a difference.
    decoder.decode_chunk(chunk, decoded);
    EXPECT_TRUE(decoded == records);
  }
}

TEST(LazChunk, RoundTripsFilesOfChunks) {
  for (unsigned format = 0; format <= 10; ++format) {
    const std::size_t length = kRecordLengths[format];
    const ByteVector records = scanned_records(format, length, 2500);
    const LazFile file(laz_file(format, Vlr::of(format, length, 1000), records));
    ASSERT_EQ(file.chunks.size(), 3u);
    Decoder decoder(file.vlr);
    ByteVector decoded(records.size());
    std::span<std::byte> rest(decoded);
    for (const Chunk& chunk : file.chunks) {
      decoder.decode_chunk(file.chunk(chunk), rest.first(chunk.points * length));
      rest = rest.subspan(chunk.points * length);
    }
    EXPECT_TRUE(decoded == records) << format;
    EXPECT_LT(file.bytes.size(), records.size() * 2 / 3) << format;
  }
}

TEST(LazChunk, EncoderRefusesPartsOfRecords) {
  Encoder encoder(Vlr::of(0, 20));
  ByteVector out;
  EXPECT_THROW(encoder.encode_chunk({}, out), std::invalid_argument);
  EXPECT_THROW(encoder.encode_chunk(ByteVector(21), out), std::invalid_argument);
}

}  // namespace
}  // namespace terrace::stream::laz
