// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "terrace/stream/laz.hpp"

namespace terrace::stream::laz {

using ByteVector = std::vector<std::byte>;

inline ByteVector read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

/// The offset basis with which the published hashes were made, which is not the usual one.
inline constexpr std::uint64_t kFnvStart = 1469598103934665603u;

inline std::uint64_t fnv1a(std::span<const std::byte> bytes, std::uint64_t hash = kFnvStart) {
  for (const std::byte byte : bytes) {
    hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 1099511628211u;
  }
  return hash;
}

/// The fields of a LAS header that chunks need, and the positions of the bytes.
struct LazFile {
  ByteVector bytes;
  Vlr vlr;
  unsigned point_format = 0;
  std::uint64_t points = 0;
  std::size_t first_chunk = 0, table = 0;
  std::vector<Chunk> chunks;

  template <class T>
  [[nodiscard]] T at(std::size_t offset) const {
    if (offset + sizeof(T) > bytes.size()) throw std::out_of_range("the file ends too early");
    T value{};
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
  }

  explicit LazFile(ByteVector of_file) : bytes(std::move(of_file)) {
    const auto minor = at<std::uint8_t>(25);
    const auto header_size = at<std::uint16_t>(94);
    const auto data = at<std::uint32_t>(96);
    point_format = at<std::uint8_t>(104) & 0x3f;
    points = minor >= 4 ? at<std::uint64_t>(247) : at<std::uint32_t>(107);
    std::size_t vlr_at = header_size;
    for (auto remaining = at<std::uint32_t>(100); remaining > 0; --remaining) {
      const std::size_t size = at<std::uint16_t>(vlr_at + 20);
      const auto* user = reinterpret_cast<const char*>(bytes.data() + vlr_at + 2);
      if (at<std::uint16_t>(vlr_at + 18) == Vlr::kRecordId &&
          std::string_view(user, Vlr::kUserId.size()) == Vlr::kUserId) {
        vlr = Vlr::parse(std::span(bytes).subspan(vlr_at + 54, size), point_format,
                         at<std::uint16_t>(105));
      }
      vlr_at += 54 + size;
    }
    first_chunk = data + 8;
    table = at<std::uint64_t>(data);
    chunks = read_chunk_table(std::span(bytes).subspan(table), vlr, points, table - first_chunk);
  }

  [[nodiscard]] std::span<const std::byte> chunk(const Chunk& of) const {
    return std::span(bytes).subspan(first_chunk + of.offset, of.bytes);
  }
};

/// The bytes of the records of formats 0 to 10.
inline constexpr std::array<std::size_t, 11> kRecordLengths{20, 28, 26, 34, 57, 63,
                                                            30, 36, 38, 59, 67};

/// Records of a synthetic airborne scanner that sweeps over hills: pulses in time, some with two
/// returns; colours that change slowly.
inline ByteVector scanned_records(unsigned format, std::size_t length, std::size_t count) {
  std::mt19937 random(format);
  const bool modern = format >= 6;
  const bool rgb = format == 2 || format == 3 || format == 5 || format == 7 || format == 8;
  ByteVector records(length * count);
  std::uint16_t grey = 20000;
  for (std::size_t i = 0, pulse = 0; i < count; ++i) {
    std::byte* record = records.data() + i * length;
    const auto put = [record](std::size_t at, auto value) {
      std::memcpy(record + at, &value, sizeof value);
    };
    const auto noise = [&random](int range) {
      return static_cast<int>(random() % 1000) * range / 1000;
    };
    const bool second = i > 0 && i % 5 == 0;
    if (!second) ++pulse;
    const int sweep = static_cast<int>(pulse % 1000), line = static_cast<int>(pulse / 1000);
    const int returns = second || i % 5 == 4 ? 2 : 1;
    put(0, 1000000 + (line % 2 == 0 ? sweep : 1000 - sweep) * 45 + noise(20));
    put(4, 5000000 + line * 50 + noise(10));
    put(8, 30000 + sweep * (line % 40 - 20) / 10 + noise(12) - (second ? 800 + noise(600) : 0));
    put(12, static_cast<std::uint16_t>(100 + noise(60) + (second ? -40 : 0)));
    const int number = second ? 2 : 1;
    put(14, static_cast<std::uint8_t>(modern ? number | returns << 4 : number | returns << 3));
    const auto classification = static_cast<std::uint8_t>(returns == 1 ? 2 : 5);
    const double time = 400000.0 + static_cast<double>(pulse) * 5e-6;
    if (modern) {
      put(16, classification);
      put(18, static_cast<std::int16_t>((sweep - 500) * 6));
      put(20, std::uint16_t{7});
      put(22, time);
    } else {
      put(15, classification);
      put(16, static_cast<std::int8_t>((sweep - 500) / 25));
      put(18, std::uint16_t{7});
      if (format == 1 || format >= 3) put(20, time);
    }
    grey = static_cast<std::uint16_t>(grey + noise(600) - 300);
    const std::size_t at = modern ? 30 : format == 2 ? 20 : 28;
    for (std::size_t c = 0; rgb && c < 3; ++c) {
      put(at + 2 * c, static_cast<std::uint16_t>((grey + c * 1000 + random() % 400) & 0xff00));
    }
  }
  return records;
}

/// Returns a complete LAZ file of records, in chunks of vlr.chunk_size points.
inline ByteVector laz_file(unsigned format, const Vlr& vlr, std::span<const std::byte> records) {
  const std::size_t header_size = format >= 6 ? 375 : 227, length = vlr.record_length();
  const ByteVector payload = vlr.serialise();
  const std::size_t data = header_size + 54 + payload.size();
  ByteVector file(data + 8);
  const auto put = [&file](std::size_t at, auto value) {
    std::memcpy(file.data() + at, &value, sizeof value);
  };
  const std::size_t points = records.size() / length;
  std::memcpy(file.data(), "LASF", 4);
  put(24, std::uint8_t{1});
  put(25, static_cast<std::uint8_t>(format >= 6 ? 4 : 2));
  put(94, static_cast<std::uint16_t>(header_size));
  put(96, static_cast<std::uint32_t>(data));
  put(100, std::uint32_t{1});
  put(104, static_cast<std::uint8_t>(format | 0x80));
  put(105, static_cast<std::uint16_t>(length));
  if (format >= 6) {
    put(247, std::uint64_t{points});
  } else {
    put(107, static_cast<std::uint32_t>(points));
  }
  for (std::size_t axis = 0; axis < 3; ++axis) put(131 + 8 * axis, 0.01);
  std::memcpy(file.data() + header_size + 2, Vlr::kUserId.data(), Vlr::kUserId.size());
  put(header_size + 18, Vlr::kRecordId);
  put(header_size + 20, static_cast<std::uint16_t>(payload.size()));
  std::copy(payload.begin(), payload.end(),
            file.begin() + static_cast<std::ptrdiff_t>(header_size + 54));

  Encoder encoder(vlr);
  std::vector<Chunk> chunks;
  for (std::size_t done = 0; done < points;) {
    const std::size_t here = std::min<std::size_t>(vlr.chunk_size, points - done);
    const std::size_t begin = file.size();
    encoder.encode_chunk(records.subspan(done * length, here * length), file);
    chunks.push_back({.offset = begin - data - 8, .bytes = file.size() - begin, .points = here});
    done += here;
  }
  put(data, static_cast<std::int64_t>(file.size()));
  const ByteVector table = write_chunk_table(chunks, vlr);
  file.insert(file.end(), table.begin(), table.end());
  return file;
}

}  // namespace terrace::stream::laz
